//! Parameters, degenerate input and lookups by texture coordinate.

use super::{Traced, draft, shape, uniform, vector};
use lucerna_core::math::{DMat4, DVec3, Vec2, Vec3};
use lucerna_core::sampling::Pcg32;

#[test]
fn hc_g16_senseless_shapes_are_refused() {
    for plugin in ["sphere", "cylinder"] {
        for radius in [0.0, -1.0] {
            assert!(draft(plugin).float("radius", radius).errors().contains("radius"), "{plugin}");
        }
        let uneven = DMat4::from_scale(DVec3::new(1.0, 2.0, 1.0));
        assert!(draft(plugin).to_world(uneven).errors().contains("cannot be sheared"), "{plugin}");
    }
    for plugin in ["sphere", "cylinder", "disk", "rectangle", "cube"] {
        let flat = DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0));
        assert!(draft(plugin).to_world(flat).errors().contains("singular"), "{plugin}");
    }
    let missing = draft("obj").string("filename", "no such file.obj").errors();
    assert!(missing.contains("could not open the file"), "{missing}");
    assert!(draft("ply").errors().contains("filename"));
    assert!(draft("ply").string("filename", "bumpy.obj").errors().contains("bumpy.obj"));
    assert!(draft("cylinder").set("p1", vector(Vec3::ZERO)).errors().contains("same point"));
}

#[test]
fn a_stretched_cylinder_keeps_its_radius() {
    let long = DMat4::from_scale(DVec3::new(1.0, 1.0, 5.0));
    assert!((shape(&draft("cylinder").to_world(long)).area() - 10.0 * std::f32::consts::PI).abs() < 1e-4);
}

#[test]
fn points_are_found_by_their_coordinates() {
    let mut pcg = Pcg32::new(7, 7);
    let turn = DMat4::from_axis_angle(DVec3::Y, 0.4) * DMat4::from_translation(DVec3::ONE);
    for plugin in ["rectangle", "disk", "sphere", "cylinder", "obj"] {
        let mut draft = draft(plugin).to_world(turn);
        if plugin == "obj" {
            draft = draft.string("filename", "bumpy.obj");
        }
        let traced = Traced::new(shape(&draft));
        for _ in 0..300 {
            let sample = traced.shape.sample_area(uniform(&mut pcg)).expect("a point");
            let found = traced.shape.at_uv(sample.uv).expect("the point");
            assert!((found.p - sample.p).length() < 2e-5, "{plugin}: {} and {}", found.p, sample.p);
            assert!((found.n - sample.n).length() < 1e-4, "{plugin}");
            let hit = traced.hit(sample.p + sample.n * 0.01, -sample.n).expect("the surface");
            assert!((found.dp_du - hit.dp_du).length() < 1e-3 && (found.dp_dv - hit.dp_dv).length() < 1e-3, "{plugin}");
        }
        assert!(plugin == "sphere" || traced.shape.at_uv(Vec2::splat(7.0)).is_none(), "{plugin}");
    }
}

#[test]
fn vertex_attributes_are_interpolated() {
    let traced = Traced::new(shape(&draft("ply").string("filename", "bumpy.ply")));
    let mut pcg = Pcg32::new(3, 7);
    for _ in 0..200 {
        let p = traced.shape.sample_area(uniform(&mut pcg)).expect("a point").p;
        let hit = traced.hit(p + Vec3::Z, -Vec3::Z).expect("the sheet");
        let color = traced.shape.attribute("vertex_color", &hit).expect("an attribute");
        // The file has |x|, |y| and 1/4, all linear within each triangle.
        let expected = [p.x.abs(), p.y.abs(), 0.25];
        assert!(color.iter().zip(expected).all(|(c, e)| (c - e).abs() < 1e-5), "{color:?} at {p}");
        assert!(traced.shape.attribute("vertex_nothing", &hit).is_none());
    }
}

#[test]
fn flipped_and_flat_meshes() {
    let file = || draft("obj").string("filename", "bumpy.obj");
    let traced = |d| Traced::new(shape(&d));
    let (plain, flipped) = (traced(file()), traced(file().bool("flip_normals", true)));
    let flat = traced(file().bool("face_normals", true));
    let (o, d) = (Vec3::new(0.21, 0.37, 5.0), -Vec3::Z);
    let [plain, flipped, flat] = [&plain, &flipped, &flat].map(|t| t.hit(o, d).expect("the sheet"));
    assert!(plain.n.z > 0.0 && (plain.n + flipped.n).length() < 1e-6);
    assert!((plain.frame.n + flipped.frame.n).length() < 1e-6);
    assert!((flat.frame.n - flat.n).length() < 1e-6 && (plain.frame.n - plain.n).length() > 1e-3);
    assert!(flipped.frame.s.cross(flipped.frame.t).dot(flipped.frame.n) > 0.999);
}

/// Texture coordinates that collapse, are huge or missing; a normal that vanishes between opposite ones.
#[test]
fn hc_g07_g08_frames_are_finite_and_orthonormal() {
    let folder = std::env::temp_dir().join(format!("lucerna-frames-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let corners = "v 0 0 0\nv 2 0 0\nv 0 2 0\n";
    let files = [
        "vt 0.5 0.5\nf 1/1 2/1 3/1\n",
        "vt 1e6 1e6\nvt 1000001 1e6\nvt 1e6 1000001\nf 1/1 2/2 3/3\n",
        "vt 0 0\nvt 1e-30 0\nvt 0 1e-30\nf 1/1 2/2 3/3\n",
        "f 1 2 3\n",
        "vn 1 0 0\nvn -1 0 0\nvn 0 0 0\nf 1//1 2//2 3//3\n",
    ];
    for (number, file) in files.into_iter().enumerate() {
        let path = folder.join(format!("{number}.obj"));
        std::fs::write(&path, format!("{corners}{file}")).expect("a file");
        let traced = Traced::new(shape(&draft("obj").string("filename", &path.to_string_lossy())));
        for (x, y) in [(0.5, 0.5), (1.0, 0.0), (0.999, 1e-4), (0.1, 1.7)] {
            let Some(hit) = traced.hit(Vec3::new(x, y, 1.0), -Vec3::Z) else { continue };
            assert!(hit.dp_du.is_finite() && hit.dp_dv.is_finite() && hit.uv.is_finite(), "{file}");
            let frame = hit.frame;
            assert!(frame.n.is_normalized() && frame.s.is_normalized() && frame.t.is_normalized(), "{file} {frame:?}");
            assert!(frame.s.dot(frame.n).abs() < 1e-5 && frame.s.cross(frame.t).dot(frame.n) > 0.999, "{file}");
        }
    }
    std::fs::remove_dir_all(&folder).expect("the folder");
}
