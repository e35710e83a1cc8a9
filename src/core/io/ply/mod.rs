//! PLY: ASCII, binary little and big endian.
//!
//! Elements `vertex` (`x y z`, optionally `nx ny nz`, texture coordinates as `u v`, `s t` or `texture_u texture_v`)
//! and `face` (a list `vertex_indices` or `vertex_index`; polygons become fans); other elements are passed over.
//! Further properties become [`MeshAttribute`]s named as the reference renderer names them: `r g b [a]` or
//! `red green blue [alpha]` are `vertex_color`, `foo_r foo_g foo_b` are `vertex_foo_color`, and `foo_x foo_y foo_z` or
//! `foo_0 foo_1 …` are `vertex_foo` (`face_…` in faces). In addition, a single property whose own name starts with
//! `vertex_` or `face_` is an attribute of one channel. Values are kept as stored: bytes are not divided by 255.
//!
//! The header is read by the crate `ply-rs-bw`. Rows of any layout go through `rows`, because the crate refuses
//! numbers such as `.5` and `nan` in text and needs some hundred bytes of memory per row; binary files with the usual
//! layout take the fixed-stride way of `fast`. The tests compare both with the crate.

mod attributes;
mod fast;
mod header;
mod rows;

use glam::{Vec2, Vec3};

use self::attributes::Attributes;
use self::header::{Element, Property};
use self::rows::{Row, Rows};
use super::limits::index;
use super::{IoError, MeshAttribute, Result, TriangleMesh};

/// Reads a mesh from the bytes of a PLY file.
///
/// # Errors
/// With line, byte, vertex or face: for a damaged or truncated file, counts that exceed the file, indices out of
/// range, faces with fewer than three corners, missing coordinates, values that are not finite.
pub fn read(bytes: &[u8]) -> Result<TriangleMesh> {
    read_with(bytes, true)
}

/// As [`read`]; without `fast`, all rows take the general way.
fn read_with(bytes: &[u8], fast: bool) -> Result<TriangleMesh> {
    let header = header::read(bytes)?;
    let mut rows = Rows::new(bytes, &header)?;
    let vertex_count = header.elements.iter().find(|element| element.name == "vertex").map_or(0, |e| e.count);
    let mut mesh = TriangleMesh::default();
    // An element without properties has no data in binary files and blank lines in text, which are skipped anyway.
    for element in header.elements.iter().filter(|element| !element.properties.is_empty()) {
        let count = rows.count(element)?;
        match element.name.as_str() {
            "vertex" => {
                let mut vertices = Vertices::new(element, count)?;
                if !(fast && fast::vertices(&mut rows, element, count, &mut vertices)?) {
                    let mut row = Row::default();
                    for vertex in 0..count {
                        rows.read(element, &mut row)?;
                        for (property, &value) in row.scalars.iter().enumerate() {
                            vertices.set(vertex, property, value as f32);
                        }
                    }
                }
                vertices.finish(&mut mesh);
            }
            "face" => {
                let mut faces = Faces::new(element, vertex_count as usize, bytes.len())?;
                if !(fast && fast::faces(&mut rows, element, count, &mut faces)?) {
                    let mut row = Row::default();
                    for _ in 0..count {
                        rows.read(element, &mut row)?;
                        faces.push(row.lists[faces.list].iter().map(|&i| i as i64), |property| {
                            row.scalars[property] as f32
                        })?;
                    }
                }
                faces.finish(&mut mesh);
            }
            _ => {
                let mut row = Row::default();
                (0..count).try_for_each(|_| rows.read(element, &mut row))?;
            }
        }
    }
    mesh.finish()
}

/// Where a property of a vertex goes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Target {
    Nowhere,
    Position(usize),
    Normal(usize),
    Uv(usize),
    /// Attribute and channel.
    Attribute(usize, usize),
}

/// Collects the vertices.
struct Vertices {
    targets: Vec<Target>,
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    uvs: Vec<Vec2>,
    attributes: Vec<MeshAttribute>,
}

impl Vertices {
    fn new(element: &Element, count: usize) -> Result<Self> {
        let scalar = |name: &str| element.properties.iter().position(|p| p.name == name && p.length.is_none());
        let mut targets = vec![Target::Nowhere; element.properties.len()];
        let mut assign = |names: &[&str], target: fn(usize) -> Target| {
            let found: Option<Vec<usize>> = names.iter().map(|name| scalar(name)).collect();
            for (axis, &property) in found.iter().flatten().enumerate() {
                targets[property] = target(axis);
            }
            found.is_some()
        };
        if !assign(&["x", "y", "z"], Target::Position) {
            return Err(IoError::new("the vertices have no x, y and z"));
        }
        let has_normals = assign(&["nx", "ny", "nz"], Target::Normal);
        // Where a file has several, the reference takes the first of this order.
        let has_uvs =
            [["u", "v"], ["texture_u", "texture_v"], ["s", "t"]].iter().any(|names| assign(names, Target::Uv));
        let Attributes { attributes, channels } = Attributes::find(element, "vertex");
        for (property, slot, channel) in channels {
            if targets[property] == Target::Nowhere {
                targets[property] = Target::Attribute(slot, channel);
            }
        }
        let attributes = attributes
            .into_iter()
            .map(|a| MeshAttribute { data: vec![0.0; count * a.channels as usize], ..a })
            .collect();
        Ok(Vertices {
            targets,
            positions: vec![Vec3::ZERO; count],
            normals: vec![Vec3::ZERO; if has_normals { count } else { 0 }],
            uvs: vec![Vec2::ZERO; if has_uvs { count } else { 0 }],
            attributes,
        })
    }

    fn set(&mut self, vertex: usize, property: usize, value: f32) {
        match self.targets[property] {
            Target::Nowhere => {}
            Target::Position(axis) => self.positions[vertex][axis] = value,
            Target::Normal(axis) => self.normals[vertex][axis] = value,
            Target::Uv(axis) => self.uvs[vertex][axis] = value,
            Target::Attribute(slot, channel) => {
                let attribute = &mut self.attributes[slot];
                attribute.data[vertex * attribute.channels as usize + channel] = value;
            }
        }
    }

    fn finish(self, mesh: &mut TriangleMesh) {
        mesh.positions = self.positions;
        mesh.normals = self.normals;
        mesh.uvs = self.uvs;
        mesh.attributes.extend(self.attributes);
    }
}

/// Collects the faces.
struct Faces {
    /// The property with the vertex indices.
    list: usize,
    vertex_count: usize,
    /// Faces so far.
    count: usize,
    triangles: Vec<[u32; 3]>,
    attributes: Vec<MeshAttribute>,
    /// For each number of an attribute in order: attribute and property.
    channels: Vec<(usize, usize)>,
    corners: Vec<u32>,
    /// Most numbers of attributes: a polygon repeats its own for each triangle of its fan.
    most_numbers: usize,
}

impl Faces {
    fn new(element: &Element, vertex_count: usize, file_size: usize) -> Result<Self> {
        let is_indices = |p: &Property| matches!(p.name.as_str(), "vertex_indices" | "vertex_index");
        let list = element
            .properties
            .iter()
            .position(|p| is_indices(p) && p.length.is_some())
            .ok_or_else(|| IoError::new("the faces have no list vertex_indices"))?;
        let Attributes { attributes, mut channels } = Attributes::find(element, "face");
        channels.sort_by_key(|&(_, slot, channel)| (slot, channel));
        let channels = channels.into_iter().map(|(property, slot, _)| (slot, property)).collect();
        let (triangles, corners) = (Vec::new(), Vec::new());
        let most_numbers = file_size.saturating_add(1 << 24);
        Ok(Faces { list, vertex_count, count: 0, triangles, attributes, channels, corners, most_numbers })
    }

    /// Adds a face as a fan; `value` gives the number stored for a property.
    fn push(&mut self, indices: impl Iterator<Item = i64>, value: impl Fn(usize) -> f32) -> Result<()> {
        let face = self.count;
        self.corners.clear();
        for corner in indices {
            self.corners.push(index(corner, self.vertex_count, || format!("face {face} (from 0)"))?);
        }
        let [first, ring @ ..] = &self.corners[..] else {
            return Err(IoError::new(format!("face {face} (from 0) has no corners")));
        };
        if ring.len() < 2 {
            return Err(IoError::new(format!("face {face} (from 0) has only {} corners", ring.len() + 1)));
        }
        if (self.triangles.len() + ring.len()).saturating_mul(self.channels.len()) > self.most_numbers {
            return Err(IoError::new(format!("face {face} (from 0): too many attributes on large polygons")));
        }
        for edge in ring.windows(2) {
            self.triangles.push([*first, edge[0], edge[1]]);
            for &(slot, property) in &self.channels {
                self.attributes[slot].data.push(value(property));
            }
        }
        self.count += 1;
        Ok(())
    }

    fn finish(self, mesh: &mut TriangleMesh) {
        mesh.triangles = self.triangles;
        mesh.attributes.extend(self.attributes);
    }
}

#[cfg(test)]
mod tests {
    use ply_rs_bw::parser::Parser;
    use ply_rs_bw::ply::{DefaultElement, Property};

    use super::*;

    fn ascii(vertex: &str, rows: &str, face: &str, faces: &str) -> String {
        let element = |name: &str, properties: &str, rows: &str| {
            let properties: String = properties.split(", ").map(|p| format!("property {p}\n")).collect();
            format!("element {name} {}\n{properties}", rows.lines().count())
        };
        let head = element("vertex", vertex, rows) + &element("face", face, faces);
        format!("ply\nformat ascii 1.0\n{head}end_header\n{rows}\n{faces}\n")
    }

    const XYZ: &str = "float x, float y, float z";
    const POINTS: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0";
    const LIST: &str = "list uchar int vertex_indices";

    fn with(vertex: &str, values: &str) -> TriangleMesh {
        let rows = POINTS.replace('\n', &format!(" {values}\n")) + " " + values;
        read(ascii(&format!("{XYZ}, {vertex}"), &rows, LIST, "3 0 1 2").as_bytes()).unwrap()
    }

    fn error(bytes: impl AsRef<[u8]>) -> String {
        read(bytes.as_ref()).unwrap_err().message
    }

    /// A binary file with normals, texture coordinates and colours; a triangle and a quad.
    fn binary(big_endian: bool, face_extra: bool) -> Vec<u8> {
        let encoding = if big_endian { "binary_big_endian" } else { "binary_little_endian" };
        let vertex: String = ["x", "y", "z", "nx", "ny", "nz", "s", "t", "r", "g", "b"]
            .iter()
            .map(|name| format!("property float {name}\n"))
            .collect();
        let extra = if face_extra { "property uchar flags\nproperty float area_0\n" } else { "" };
        let mut file = format!(
            "ply\r\nformat {encoding} 1.0 \r\ncomment made by hand\r\nobj_info 7\r\nelement vertex 4\n{vertex}\
             property uchar material\nelement face 2\nproperty list uchar int vertex_indices\n{extra}end_header\n"
        )
        .into_bytes();
        let float = |x: f32| if big_endian { x.to_be_bytes() } else { x.to_le_bytes() };
        let int = |x: i32| if big_endian { x.to_be_bytes() } else { x.to_le_bytes() };
        for (i, (x, y)) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].into_iter().enumerate() {
            for value in [x, y, 0.25, 0.0, 0.0, 1.0, x, y, 0.5, i as f32, 2.0] {
                file.extend(float(value));
            }
            file.push(7);
        }
        for indices in [&[0, 1, 2][..], &[3, 2, 1, 0]] {
            file.push(indices.len() as u8);
            indices.iter().for_each(|&i| file.extend(int(i)));
            if face_extra {
                file.push(1);
                file.extend(float(indices.len() as f32));
            }
        }
        file
    }

    #[test]
    fn all_encodings_and_both_ways_agree() {
        let expected = read(&binary(false, false)).unwrap();
        assert_eq!(expected.triangles, [[0, 1, 2], [3, 2, 1], [3, 1, 0]]);
        assert_eq!(expected.positions[2], Vec3::new(1.0, 1.0, 0.25));
        assert_eq!(expected.uvs[3], Vec2::Y);
        assert_eq!(expected.normals, [Vec3::Z; 4]);
        assert_eq!(expected.attributes.len(), 1);
        assert_eq!(expected.attributes[0].data[..6], [0.5, 0.0, 2.0, 0.5, 1.0, 2.0]);
        for big_endian in [false, true] {
            for fast in [false, true] {
                assert_eq!(read_with(&binary(big_endian, false), fast), Ok(expected.clone()));
                let with_extra = read_with(&binary(big_endian, true), fast).unwrap();
                assert_eq!(with_extra.triangles, expected.triangles);
                let area = MeshAttribute { name: "face_area".into(), channels: 1, data: vec![3.0, 4.0, 4.0] };
                assert_eq!(with_extra.attributes[1], area);
            }
        }
    }

    #[test]
    fn texture_coordinates_and_attributes_are_found_by_name() {
        for names in ["float u, float v", "float s, float t", "double texture_u, double texture_v"] {
            assert_eq!(with(names, "0.25 .5").uvs, [Vec2::new(0.25, 0.5); 4]);
        }
        assert_eq!(with("float u, float v, float s, float t", "1 2 3 4").uvs[0], Vec2::new(1.0, 2.0));
        assert!(with("float u", "1").uvs.is_empty());
        for (properties, values, name, expected) in [
            ("uchar red, uchar green, uchar blue", "0 128 255", "vertex_color", &[0.0, 128.0, 255.0][..]),
            ("float b, float g, float r", "3 2 1", "vertex_color", &[1.0, 2.0, 3.0]),
            ("float r, float g, float b, float a", "1 2 3 4", "vertex_color", &[1.0, 2.0, 3.0, 4.0]),
            ("float foo_r, float foo_g, float foo_b", "1 2 3", "vertex_foo_color", &[1.0, 2.0, 3.0]),
            ("float foo_bar_x, float foo_bar_y, float foo_bar_z", "1 2 3", "vertex_foo_bar", &[1.0, 2.0, 3.0]),
            ("float one_0", "7", "vertex_one", &[7.0]),
            ("float vertex_heat", "7", "vertex_heat", &[7.0]),
        ] {
            let mesh = with(properties, values);
            assert_eq!(mesh.attributes.len(), 1, "{properties}");
            let attribute = &mesh.attributes[0];
            assert_eq!((attribute.name.as_str(), attribute.channels as usize), (name, expected.len()));
            assert_eq!(attribute.data, expected.repeat(4), "{properties}");
        }
        assert!(with("float quality, float texture_s, float texture_t", "1 2 3").attributes.is_empty());
    }

    #[test]
    fn odd_layouts_load() {
        let expected = with("float quality", "1");
        let extra = "ply\nformat ascii 1.0\n\nelement camera 1\nproperty list char float k\nelement face 1\n\
            property list int uint vertex_index\nelement vertex 4\nproperty double x\nproperty double y\n\
            property double z\nproperty list uchar uchar tags\nelement nothing 3\nend_header\n2 1 2\n\
            3 0 1 2 trailing tokens\n\n0 0 0 0\n1 0 0 2 5 6\n1 1 0 0\n0 1 0 1 9";
        assert_eq!(read(extra.as_bytes()).unwrap().triangles, expected.triangles);
        assert_eq!(read(extra.as_bytes()).unwrap().positions, expected.positions);
        assert_eq!(read(extra.replace('\n', "\r\n").as_bytes()).unwrap().positions, expected.positions);
        let polygon = ascii(XYZ, POINTS, LIST, "4 0 1 2 3");
        assert_eq!(read(polygon.as_bytes()).unwrap().triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn errors_name_the_place() {
        let faces = |faces: &str| error(ascii(XYZ, POINTS, LIST, faces));
        assert_eq!(faces("3 0 1 2\n3 0 1 4"), "face 1 (from 0): index 4 is out of range, there are 4");
        assert_eq!(faces("3 0 1 -1"), "face 0 (from 0): index -1 is out of range, there are 4");
        assert_eq!(faces("2 0 1"), "face 0 (from 0) has only 2 corners");
        assert_eq!(
            faces("3 0 1"),
            "line 14: declares 3 list entries of at least 2 bytes each, but only 4 bytes are left"
        );
        assert_eq!(faces("3 0 1 x"), "line 14: no number for \"vertex_indices\"");
        assert!(faces("200 0 1 2").starts_with("line 14: declares 200"));
        assert!(faces("-3 0 1 2").starts_with("line 14: "));
        assert_eq!(faces(""), "the mesh has no faces");
        let nan = POINTS.replacen('1', "nan", 1);
        assert_eq!(error(ascii(XYZ, &nan, LIST, "3 0 1 2")), "vertex 1 (from 0): the position is not finite");
        assert_eq!(error(ascii(XYZ, &nan.replace("nan", "one"), LIST, "3 0 1 2")), "line 11: no number for \"x\"");
        assert!(error(ascii("float x, float y", "0 0", LIST, "3 0 0 0")).contains("no x, y and z"));
        assert!(error(ascii("float x, float y, float x", "0 0 0", LIST, "3 0 0 0")).contains("twice"));
        assert_eq!(error(""), "is not a PLY file: it does not begin with \"ply\"");
        assert_eq!(error("ply\n"), "line 2: the header has no end_header");
        assert!(error("ply\nformat ascii 1.0\nelement vertex -4\nend_header\n").starts_with("line 3: neither"));
        let file = String::from_utf8_lossy(&binary(false, false)).into_owned();
        for count in ["4000000000", "18446744073709551615"] {
            let huge = file.replace("vertex 4", &format!("vertex {count}"));
            assert!(error(&huge).contains("declares"), "{}", error(&huge));
            let huge = file.replace("face 2", &format!("face {count}"));
            assert!(error(&huge).contains("declares"), "{}", error(&huge));
        }
        let valid = binary(false, false);
        assert!(error(&valid[..valid.len() - 1]).contains("ends inside the faces"));
    }

    #[test]
    fn large_polygons_with_many_attributes_do_not_explode() {
        let channels: Vec<String> = (0..200).map(|i| format!("uchar face_c{i}_0")).collect();
        let polygon = format!("150000{}{}", " 0".repeat(150_000), " 1".repeat(200));
        let face = format!("list int int vertex_indices, {}", channels.join(", "));
        assert!(error(ascii(XYZ, POINTS, &face, &polygon)).contains("too many attributes"));
    }

    /// Reads the basic quantities with `ply-rs-bw` alone.
    fn oracle(mut bytes: &[u8]) -> TriangleMesh {
        let ply = Parser::<DefaultElement>::new().read_ply(&mut bytes).unwrap();
        let float = |row: &DefaultElement, name: &str| row.get(name).and_then(Property::to_f32_lossy);
        let mut mesh = TriangleMesh::default();
        for row in &ply.payload["vertex"] {
            let vec3 = |names: [&str; 3]| Some(Vec3::from(names.map(|n| float(row, n).unwrap_or(f32::NAN))));
            mesh.positions.extend(vec3(["x", "y", "z"]));
            mesh.normals.extend(vec3(["nx", "ny", "nz"]).filter(|n| n.is_finite()));
            let uv = ["u", "s"].iter().find_map(|n| float(row, n)).zip(["v", "t"].iter().find_map(|n| float(row, n)));
            mesh.uvs.extend(uv.map(Vec2::from));
        }
        for row in &ply.payload["face"] {
            let list = row.get("vertex_indices").or_else(|| row.get("vertex_index")).unwrap();
            let corners: Vec<u32> = match list {
                Property::ListInt(list) => list.iter().map(|&i| i as u32).collect(),
                Property::ListUInt(list) => list.clone(),
                other => panic!("{other:?}"),
            };
            mesh.triangles.extend(corners[1..].windows(2).map(|edge| [corners[0], edge[0], edge[1]]));
        }
        mesh
    }

    fn assert_equals_oracle(bytes: &[u8]) {
        let expected = oracle(bytes).finish().unwrap();
        for fast in [false, true] {
            let mesh = TriangleMesh { attributes: vec![], ..read_with(bytes, fast).unwrap() };
            assert!(mesh == expected);
        }
    }

    #[test]
    fn reads_what_the_crate_reads() {
        [(false, false), (false, true), (true, false), (true, true)]
            .into_iter()
            .for_each(|(big_endian, extra)| assert_equals_oracle(&binary(big_endian, extra)));
        // Scenes of the reader's own: a folder of folders with `models` in them.
        let Some(scenes) = std::env::var_os("LUCERNA_SCENES") else { return };
        for models in std::fs::read_dir(scenes).into_iter().flatten().flatten().map(|e| e.path().join("models")) {
            for file in std::fs::read_dir(models).into_iter().flatten().flatten().map(|e| e.path()) {
                if file.extension().is_some_and(|e| e == "ply") {
                    assert_equals_oracle(&std::fs::read(file).unwrap());
                }
            }
        }
    }
}
