//! Wavefront OBJ: `v`, `vt`, `vn` and `f` lines; everything else (groups, materials, smoothing) is passed over.
//!
//! Rules of the format as the reference renderer reads it: one mesh per file; a vertex is shared by all corners with
//! the same (v, vt, vn) and numbered by its first use; polygons become fans (0, i, i+1); faces of one or two corners
//! are dropped; a corner may only name what stands above it. Beyond it, negative (relative) indices, lines of any
//! length and continued lines (`\` at the end) load. Where a file has normals or texture coordinates but some corners
//! name none, the reference shades with uninitialised memory; here such a normal comes from the adjacent faces and
//! such a texture coordinate is (0, 0). A file in which no corner names any counts as having none.
//!
//! Why a scanner of our own rather than the `tobj` crate, which remains the oracle in the tests: its errors have no
//! position, it splits files by groups and materials, with corners that lack a texture coordinate the remaining ones
//! shift against their vertices, index 0 counts as "absent", a file in which only some vertices have colours fails, and
//! it takes several times as long.

use std::collections::HashMap;

use glam::{Vec2, Vec3};

use super::{IoError, Result, TriangleMesh};

/// Stands for "no texture coordinate" and "no normal" in a corner.
const ABSENT: u32 = u32::MAX;

const NOT_A_CORNER: &str = "a face corner is not v, v/vt, v//vn or v/vt/vn";

/// Reads a mesh from the bytes of an OBJ file. Texture coordinates are returned as stored, without flipping v.
///
/// # Errors
/// With the line, for numbers that cannot be read, an index that is 0 or out of range, and non-finite values; without
/// one if there are no vertices or faces.
pub fn read(bytes: &[u8]) -> Result<TriangleMesh> {
    let mut reader = Reader::default();
    let mut rest = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
    while !rest.is_empty() {
        let start = bytes.len() - rest.len();
        reader.line(&mut rest).map_err(|wrong| {
            let line = 1 + bytes[..start].iter().filter(|&&byte| byte == b'\n').count();
            IoError::new(format!("line {line}: {wrong}"))
        })?;
        // What is left of the line is a comment, or nothing that is read here.
        let end = rest.iter().position(|&byte| byte == b'\n');
        rest = end.map_or(&[], |end| &rest[end + 1..]);
    }
    reader.finish()
}

/// Passes over white space within a line, which goes on behind a backslash at its end.
fn trim(rest: &mut &[u8]) {
    while let [b' ' | b'\t' | b'\r' | 0x0B | 0x0C, tail @ ..]
    | [b'\\', b'\n', tail @ ..]
    | [b'\\', b'\r', b'\n', tail @ ..] = rest
    {
        *rest = tail;
    }
}

/// Whether a word ends here.
fn at_end_of_word(rest: &[u8]) -> bool {
    matches!(rest.first(), None | Some(b' ' | b'\t' | b'\r' | b'\n' | 0x0B | 0x0C | b'\\'))
}

#[derive(Default)]
struct Reader {
    positions: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    shared: SharedVertices,
    triangles: Vec<[u32; 3]>,
    face: Vec<u32>,
}

impl Reader {
    /// Reads the statement at the front of `rest`, as far as it matters.
    fn line(&mut self, rest: &mut &[u8]) -> std::result::Result<(), String> {
        trim(rest);
        match rest {
            [b'v', b' ' | b'\t', tail @ ..] => {
                *rest = tail;
                let position = Vec3::from(numbers(rest)?);
                if !position.is_finite() {
                    return Err(format!("vertex {} is not finite", self.positions.len() + 1));
                }
                self.positions.push(position);
            }
            [b'v', b't', b' ' | b'\t', tail @ ..] => {
                *rest = tail;
                let uv = Vec2::from(numbers(rest)?);
                if !uv.is_finite() {
                    return Err(format!("texture coordinate {} is not finite", self.uvs.len() + 1));
                }
                self.uvs.push(uv);
            }
            // A normal that is not finite is treated as missing when the mesh is finished.
            [b'v', b'n', b' ' | b'\t', tail @ ..] => {
                *rest = tail;
                self.normals.push(Vec3::from(numbers(rest)?));
            }
            [b'f', b' ' | b'\t', tail @ ..] => {
                *rest = tail;
                self.face(rest)?;
            }
            _ => {}
        }
        Ok(())
    }

    fn face(&mut self, rest: &mut &[u8]) -> std::result::Result<(), String> {
        self.face.clear();
        loop {
            trim(rest);
            if matches!(rest.first(), None | Some(b'\n' | b'#')) {
                break;
            }
            let corner = self.corner(rest)?;
            let vertex = self.shared.number_of(corner);
            self.face.push(vertex);
        }
        if let [first, ring @ ..] = &self.face[..] {
            self.triangles.extend(ring.windows(2).map(|edge| [*first, edge[0], edge[1]]));
        }
        Ok(())
    }

    /// One corner `v`, `v/vt`, `v//vn` or `v/vt/vn` as indices from 0.
    fn corner(&self, tail: &mut &[u8]) -> std::result::Result<[u32; 3], String> {
        let mut corner = [0, ABSENT, ABSENT];
        let kinds =
            [("vertex", self.positions.len()), ("texture coordinate", self.uvs.len()), ("normal", self.normals.len())];
        for (slot, (kind, count)) in kinds.into_iter().enumerate() {
            if slot > 0 {
                match tail {
                    [b'/', rest @ ..] => *tail = rest,
                    _ => break,
                }
                if !matches!(tail.first(), Some(b'-' | b'+' | b'0'..=b'9')) {
                    continue;
                }
            }
            let stored = integer(tail)?;
            let from_zero = if stored < 0 { count as i64 + stored } else { stored - 1 };
            corner[slot] = u32::try_from(from_zero)
                .ok()
                .filter(|&index| (index as usize) < count)
                .ok_or_else(|| format!("{kind} {stored} does not exist ({count} so far)"))?;
        }
        if at_end_of_word(tail) { Ok(corner) } else { Err(NOT_A_CORNER.into()) }
    }

    fn finish(self) -> Result<TriangleMesh> {
        let corners = &self.shared.corners;
        if self.positions.is_empty() {
            return Err(IoError::new("the mesh has no vertices"));
        }
        let (has_uvs, has_normals) = corners
            .iter()
            .fold((false, false), |(uv, n), corner| (uv | (corner[1] != ABSENT), n | (corner[2] != ABSENT)));
        let lookup = |index: u32| (index != ABSENT).then_some(index as usize);
        let mut mesh = TriangleMesh {
            positions: corners.iter().map(|corner| self.positions[corner[0] as usize]).collect(),
            triangles: self.triangles,
            ..TriangleMesh::default()
        };
        if has_uvs {
            mesh.uvs = corners.iter().map(|corner| lookup(corner[1]).map_or(Vec2::ZERO, |i| self.uvs[i])).collect();
        }
        if has_normals {
            mesh.normals =
                corners.iter().map(|corner| lookup(corner[2]).map_or(Vec3::ZERO, |i| self.normals[i])).collect();
        }
        if mesh.triangles.is_empty() {
            return Err(IoError::new("the mesh has no faces with three corners or more"));
        }
        mesh.finish()
    }
}

/// The first `N` numbers of a line; further ones (w, colours) are passed over.
fn numbers<const N: usize>(rest: &mut &[u8]) -> std::result::Result<[f32; N], String> {
    let mut numbers = [0.0; N];
    for number in &mut numbers {
        trim(rest);
        let parsed = fast_float2::parse_partial::<f32, _>(*rest).ok();
        let (value, length) = parsed
            .filter(|&(_, length)| at_end_of_word(&rest[length..]))
            .ok_or_else(|| format!("{N} numbers are expected"))?;
        *number = value;
        *rest = &rest[length..];
    }
    Ok(numbers)
}

/// A signed integer at the front of `tail`, saturated far outside any range of indices.
fn integer(tail: &mut &[u8]) -> std::result::Result<i64, String> {
    let (negative, digits) = match *tail {
        [b'-', digits @ ..] => (true, digits),
        [b'+', digits @ ..] => (false, digits),
        digits => (false, digits),
    };
    let length = digits.iter().take_while(|byte| byte.is_ascii_digit()).count();
    if length == 0 {
        return Err(NOT_A_CORNER.into());
    }
    let value = digits[..length].iter().fold(0i64, |value, &digit| (value * 10 + i64::from(digit - b'0')).min(1 << 40));
    *tail = &digits[length..];
    Ok(if negative { -value } else { value })
}

/// Numbers the distinct (v, vt, vn) triples in the order of their first use.
///
/// Corners of one position form a short chain, which is faster than hashing; a position with very many different
/// corners continues in a hash map, so that no file can make the search quadratic.
#[derive(Default)]
struct SharedVertices {
    corners: Vec<[u32; 3]>,
    /// For each corner the next one with the same position, or [`ABSENT`].
    next: Vec<u32>,
    /// For each position its latest corner, or [`ABSENT`].
    latest: Vec<u32>,
    crowd: HashMap<[u32; 3], u32>,
}

impl SharedVertices {
    const LONGEST_CHAIN: usize = 32;

    fn number_of(&mut self, corner: [u32; 3]) -> u32 {
        let position = corner[0] as usize;
        if position >= self.latest.len() {
            self.latest.resize((position + 1).next_power_of_two(), ABSENT);
        }
        let mut at = self.latest[position];
        let mut length = 0;
        while at != ABSENT {
            if self.corners[at as usize] == corner {
                return at;
            }
            at = self.next[at as usize];
            length += 1;
        }
        let new = self.corners.len() as u32;
        let mut follower = ABSENT;
        if length < Self::LONGEST_CHAIN {
            follower = std::mem::replace(&mut self.latest[position], new);
        } else {
            let number = *self.crowd.entry(corner).or_insert(new);
            if number != new {
                return number;
            }
        }
        self.corners.push(corner);
        self.next.push(follower);
        new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 5\n";
    const FULL: &str = "# a comment\nmtllib x.mtl\no thing\nv 0 0 0\nv 1 0 0 1\nv 1 1 0 0.5 0.5 0.5\nv 0 1 -1.5e0\n\
        vt 0.25 0.5\nvt 0 1 0\nvn 0 0 2\nvn 0 1 0\ng a\nusemtl m\ns off\nf 1/1/1 2/2/1 3/2/1\nf 1/1/1 3/2/1 4/1/2\n";

    fn mesh(text: &str) -> TriangleMesh {
        read(text.as_bytes()).unwrap()
    }

    fn error(text: &str) -> String {
        read(text.as_bytes()).unwrap_err().message
    }

    fn with_corners(text: &str) -> String {
        format!("{CORNERS}{text}")
    }

    #[test]
    fn vertices_are_shared_and_numbered_by_first_use() {
        let read = mesh(FULL);
        assert_eq!(read.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(read.positions[3], Vec3::new(0.0, 1.0, -1.5));
        assert_eq!(read.normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::Y]);
        assert_eq!(read.uvs[..2], [Vec2::new(0.25, 0.5), Vec2::new(0.0, 1.0)]);
        assert_eq!(mesh(&with_corners("f 3 2 1\nf 1 2 5\n")).triangles, [[0, 1, 2], [2, 1, 3]]);
        let unshared = mesh(&with_corners("vt 0 0\nvt 1 1\nf 1/1 2/1 3/1\nf 1/2 2/1 3/1\n"));
        assert_eq!(unshared.triangles, [[0, 1, 2], [3, 1, 2]]);
    }

    #[test]
    fn a_crowded_position_shares_its_corners_too() {
        let mut text = with_corners("");
        (0..200).for_each(|i| text += &format!("vt {i} 0\n"));
        for _ in 0..2 {
            (1..=200).for_each(|i| text += &format!("f 1/{i} 2/1 3/1\n"));
        }
        let read = mesh(&text);
        assert_eq!((read.positions.len(), read.triangles.len()), (202, 400));
        assert_eq!(read.triangles[..200], read.triangles[200..]);
    }

    #[test]
    fn polygons_are_fanned_and_lines_dropped() {
        assert_eq!(mesh(&with_corners("f 4 3 2 1\n")).triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh(&with_corners("f 1 2\nf 1 2 3\nf 2\n")).triangles, [[0, 1, 2]]);
        let ring: String = (0..200).map(|i| format!("v {i} {} 0\n", i * i)).collect();
        let polygon: String = (1..=200).map(|i| format!(" {i}")).collect();
        assert_eq!(mesh(&format!("{ring}f{polygon}\n")).triangles.len(), 198);
    }

    #[test]
    fn relative_indices_continued_lines_and_odd_white_space_load() {
        let expected = mesh(&with_corners("f 1 2 3\n")).triangles;
        for face in [
            "f -5 -4 -3\n",
            "f 1 2 \\\n3\n",
            "f 1\\\r\n 2 3",
            "# not continued \\\nf 1 2 3",
            " \tf\t1  2\t3 # note\r\n",
            "f +1 2 3",
        ] {
            assert_eq!(mesh(&with_corners(face)).triangles, expected, "{face:?}");
        }
        assert_eq!(mesh(&format!("\u{FEFF}{}f 1 2 3\n", CORNERS.replace('\n', "\r\n"))).triangles, expected);
        assert_eq!(mesh(&with_corners(&format!("f 1 2 3 # {}\n", "x".repeat(1_000_000)))).triangles, expected);
    }

    #[test]
    fn corners_without_normal_or_texture_coordinate_get_sound_ones() {
        let partly = mesh(&with_corners("vn 0 1 0\nvt 0.5 0.5\nf 1/1/1 2//1 3//1\nf 1 3 4\n"));
        assert_eq!(partly.positions.len(), 6);
        assert_eq!(partly.normals[..3], [Vec3::Y; 3]);
        assert_eq!(partly.normals[3..], [Vec3::Z; 3]);
        assert_eq!(partly.uvs[..2], [Vec2::splat(0.5), Vec2::ZERO]);
        let unused = mesh(&with_corners("vn 0 1 0\nvt 0.5 0.5\nf 1 2 3\n"));
        assert!(unused.normals.is_empty() && unused.uvs.is_empty());
    }

    #[test]
    fn errors_name_the_line() {
        assert_eq!(error(&with_corners("f 0 1 2\n")), "line 6: vertex 0 does not exist (5 so far)");
        assert_eq!(error(&with_corners("f 1 2 6\n")), "line 6: vertex 6 does not exist (5 so far)");
        assert_eq!(error(&with_corners("f 1 2 -6\n")), "line 6: vertex -6 does not exist (5 so far)");
        assert_eq!(
            error(&with_corners("f 1 2 99999999999999999999999\n")),
            "line 6: vertex 1099511627776 does not exist (5 so far)"
        );
        assert_eq!(
            error(&with_corners("vt 0 0\nf 1/2 2/1 3/1\n")),
            "line 7: texture coordinate 2 does not exist (1 so far)"
        );
        assert_eq!(error(&with_corners("f 1//1 2 3\n")), "line 6: normal 1 does not exist (0 so far)");
        assert_eq!(error(&format!("f 1 2 3\n{CORNERS}")), "line 1: vertex 1 does not exist (0 so far)");
        assert_eq!(error(&with_corners("f 1 2 \\\n3\nf 9 1 2")), "line 8: vertex 9 does not exist (5 so far)");
        assert!(error(&with_corners("f 1/1/1/1 2 3\n")).starts_with("line 6: "));
        assert_eq!(error("v 0 0 0\nv 1,5 0 0\n"), "line 2: 3 numbers are expected");
        assert_eq!(error("v 0 0 0\nv nan 0 0\n"), "line 2: vertex 2 is not finite");
        assert_eq!(error("v 0 0 0\nv 0 1e400 0\n"), "line 2: vertex 2 is not finite");
        assert_eq!(error("v 0 0\n"), "line 1: 3 numbers are expected");
        assert_eq!(error(""), "the mesh has no vertices");
        assert_eq!(error(CORNERS), "the mesh has no faces with three corners or more");
    }

    /// Positions, normals and texture coordinates of all corners, in order, as `tobj` sees them.
    fn oracle(bytes: &[u8]) -> Vec<[f32; 8]> {
        let options = tobj::LoadOptions { single_index: false, triangulate: true, ..tobj::LoadOptions::default() };
        let (models, _) = tobj::load_obj_buf(&mut &bytes[..], &options, |_| Ok(Default::default())).unwrap();
        let mut corners = Vec::new();
        for model in models {
            let mesh = model.mesh;
            for corner in 0..mesh.indices.len() {
                let mut values = [0.0; 8];
                let p = mesh.indices[corner] as usize * 3;
                values[..3].copy_from_slice(&mesh.positions[p..p + 3]);
                if let Some(&n) = mesh.normal_indices.get(corner) {
                    values[3..6].copy_from_slice(&mesh.normals[n as usize * 3..][..3]);
                }
                if let Some(&t) = mesh.texcoord_indices.get(corner) {
                    values[6..].copy_from_slice(&mesh.texcoords[t as usize * 2..][..2]);
                }
                corners.push(values);
            }
        }
        corners
    }

    fn assert_equals_oracle(bytes: &[u8], name: &str) {
        let mesh = read(bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
        let expected = oracle(bytes);
        assert_eq!(mesh.triangles.len() * 3, expected.len(), "{name}");
        for (&vertex, expected) in mesh.triangles.as_flattened().iter().zip(&expected) {
            let i = vertex as usize;
            assert_eq!(mesh.positions[i].to_array(), expected[..3], "{name}");
            if let Some(normal) = mesh.normals.get(i) {
                let expected = Vec3::from_slice(&expected[3..]);
                assert!(expected.length() < 0.01 || (*normal - expected.normalize()).length() < 1e-6, "{name}");
            }
            if let Some(uv) = mesh.uvs.get(i) {
                assert_eq!(uv.to_array(), expected[6..], "{name}");
            }
        }
    }

    #[test]
    fn reads_what_tobj_reads() {
        // The oracle gives up when only some vertices carry a colour.
        assert_equals_oracle(FULL.replace(" 0.5 0.5 0.5", "").as_bytes(), "sample");
        // Scenes of the reader's own: a folder of folders with `models` in them.
        let Some(scenes) = std::env::var_os("LUCERNA_SCENES") else { return };
        let mut compared = 0;
        for models in std::fs::read_dir(scenes).into_iter().flatten().flatten().map(|e| e.path().join("models")) {
            let mut files: Vec<_> =
                std::fs::read_dir(models).into_iter().flatten().flatten().map(|e| e.path()).collect();
            files.sort();
            // Every 25th file of each scene keeps this quick.
            for file in files.iter().filter(|f| f.extension().is_some_and(|e| e == "obj")).step_by(25) {
                assert_equals_oracle(&std::fs::read(file).unwrap(), &file.to_string_lossy());
                compared += 1;
            }
        }
        assert!(compared > 10, "{compared} files");
    }
}
