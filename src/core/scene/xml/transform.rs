//! The operations inside `<transform>`, in double precision.

use super::attributes::Attributes;
use super::numbers::{self, Wrong};
use glam::{DMat3, DMat4, DVec3};

/// The tags that may stand inside `<transform>`.
pub(super) const OPERATIONS: [&str; 5] = ["translate", "scale", "rotate", "lookat", "matrix"];

/// The matrix of one operation. Attributes are read, not checked for strangers; see [`allowed`].
pub(super) fn operation(tag: &str, attributes: &Attributes) -> Result<DMat4, Wrong> {
    match tag {
        "translate" => Ok(DMat4::from_translation(coordinates(attributes, 0.0)?)),
        "scale" => Ok(DMat4::from_scale(coordinates(attributes, 1.0)?)),
        "rotate" => {
            let angle = numbers::float(attributes.required("angle")?)?;
            let axis = coordinates(attributes, 0.0)?;
            match axis.try_normalize() {
                Some(axis) => Ok(DMat4::from_axis_angle(axis, angle.to_radians())),
                None => Err(("the rotation axis is zero".to_owned(), None)),
            }
        }
        "lookat" => look_at(attributes),
        _ => matrix(attributes.required("value")?),
    }
}

/// The attributes an operation may have.
pub(super) fn allowed(tag: &str) -> &'static [&'static str] {
    match tag {
        "translate" | "scale" => &["x", "y", "z", "value"],
        "rotate" => &["angle", "x", "y", "z", "value"],
        "lookat" => &["origin", "target", "up"],
        _ => &["value"],
    }
}

/// `x`, `y`, `z`, each of them `missing` if not given, or `value` with one or three numbers.
fn coordinates(attributes: &Attributes, missing: f64) -> Result<DVec3, Wrong> {
    let axes = ["x", "y", "z"].map(|axis| attributes.get(axis));
    if let Some(value) = attributes.get("value") {
        if axes.iter().any(Option::is_some) {
            return Err((format!("<{}> has both \"value\" and x, y, z", attributes.tag), Some("give one of them")));
        }
        return numbers::triple(value, "vector").map(DVec3::from_array);
    }
    let mut vector = DVec3::splat(missing);
    for (i, text) in axes.into_iter().enumerate() {
        if let Some(text) = text {
            vector[i] = numbers::float(text)?;
        }
    }
    Ok(vector)
}

/// 16 numbers by rows, or 9 for the upper left 3×3 part.
fn matrix(text: &str) -> Result<DMat4, Wrong> {
    let values = numbers::floats(text)?;
    if let Ok(values) = <[f64; 16]>::try_from(&values[..]) {
        return Ok(DMat4::from_cols_array(&values).transpose());
    }
    match <[f64; 9]>::try_from(&values[..]) {
        Ok(values) => Ok(DMat4::from_mat3(DMat3::from_cols_array(&values).transpose())),
        Err(_) => Err((
            format!("a matrix has 16 or 9 numbers, this one has {}", values.len()),
            Some("row by row, separated by blanks or commas"),
        )),
    }
}

/// Places a camera at `origin`, looking along +Z at `target`, with +Y as near to `up` as can be.
fn look_at(attributes: &Attributes) -> Result<DMat4, Wrong> {
    let point = |text: &str| numbers::triple(text, "point").map(DVec3::from_array);
    let origin = point(attributes.required("origin")?)?;
    let target = point(attributes.required("target")?)?;
    let Some(direction) = (target - origin).try_normalize() else {
        return Err(("<lookat>: origin and target are the same point".to_owned(), None));
    };
    let up = match attributes.get("up").map(point).transpose()? {
        Some(up) if up != DVec3::ZERO => up,
        _ => perpendicular(direction),
    };
    let left = up.normalize_or_zero().cross(direction);
    if left.length() < 1e-9 {
        return Err(("<lookat>: \"up\" is parallel to the direction of view".to_owned(), Some("choose another up")));
    }
    let left = left.normalize();
    let up = direction.cross(left);
    Ok(DMat4::from_cols(left.extend(0.0), up.extend(0.0), direction.extend(0.0), origin.extend(1.0)))
}

/// The first tangent of the frame around a unit vector of Duff et al. 2017, "Building an Orthonormal Basis,
/// Revisited", which the reference uses too.
fn perpendicular(n: DVec3) -> DVec3 {
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    DVec3::new(1.0 + sign * n.x * n.x * a, sign * n.x * n.y * a, -sign * n.x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix_of(tag: &str, list: &[(&str, &str)]) -> Result<DMat4, Wrong> {
        operation(tag, &Attributes::from_list(tag, list))
    }

    fn rows(matrix: DMat4) -> [f64; 16] {
        matrix.transpose().to_cols_array()
    }

    #[track_caller]
    fn assert_near(actual: DMat4, expected: [f64; 16]) {
        let near = rows(actual).iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6);
        assert!(near, "{:?} is not {expected:?}", rows(actual));
    }

    #[test]
    fn translate_scale_rotate() {
        let m = matrix_of("translate", &[("x", "1"), ("z", "3")]).unwrap();
        assert_near(m, [1., 0., 0., 1., 0., 1., 0., 0., 0., 0., 1., 3., 0., 0., 0., 1.]);
        let m = matrix_of("scale", &[("value", "2")]).unwrap();
        assert_near(m, [2., 0., 0., 0., 0., 2., 0., 0., 0., 0., 2., 0., 0., 0., 0., 1.]);
        let m = matrix_of("scale", &[("y", "-2")]).unwrap();
        assert_near(m, [1., 0., 0., 0., 0., -2., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.]);
        let m = matrix_of("rotate", &[("z", "5"), ("angle", "90")]).unwrap();
        assert_near(m, [0., -1., 0., 0., 1., 0., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.]);
    }

    #[test]
    fn matrices_are_written_by_rows() {
        let text = "1 2 3 4  5 6 7 8  9 10 11 12  0 0 0 1";
        let m = matrix_of("matrix", &[("value", text)]).unwrap();
        assert_eq!(m.w_axis.truncate(), DVec3::new(4.0, 8.0, 12.0));
        let m = matrix_of("matrix", &[("value", "1 2 3 4 5 6 7 8 9")]).unwrap();
        assert_near(m, [1., 2., 3., 0., 4., 5., 6., 0., 7., 8., 9., 0., 0., 0., 0., 1.]);
        let wrong = matrix_of("matrix", &[("value", "1 2")]).unwrap_err();
        assert_eq!(wrong.0, "a matrix has 16 or 9 numbers, this one has 2");
    }

    /// The expected numbers were printed by the reference.
    #[test]
    fn look_at_is_the_references() {
        let view = [("origin", "1 2 3"), ("target", "4 -1 2")];
        let made_up = [
            0.385292, 0.614708, 0.688247, 1., 0.614708, 0.385292, -0.688247, 2., -0.688247, 0.688247, -0.229416, 3.,
            0., 0., 0., 1.,
        ];
        assert_near(matrix_of("lookat", &view).unwrap(), made_up);
        let zero = [view[0], view[1], ("up", "0 0 0")];
        assert_near(matrix_of("lookat", &zero).unwrap(), made_up);
        let given = [view[0], view[1], ("up", "0 1 0")];
        let expected = [
            -0.316228, 0.652929, 0.688247, 1., 0., 0.725476, -0.688247, 2., -0.948683, -0.217643, -0.229416, 3., 0.,
            0., 0., 1.,
        ];
        assert_near(matrix_of("lookat", &given).unwrap(), expected);
    }

    #[test]
    fn hc_e08_degenerate() {
        let message = |tag, list: &[_]| matrix_of(tag, list).unwrap_err().0;
        let same = [("origin", "1 1 1"), ("target", "1 1 1")];
        assert_eq!(message("lookat", &same), "<lookat>: origin and target are the same point");
        let parallel = [("origin", "0 0 0"), ("target", "0 5 0"), ("up", "0 1 0")];
        assert_eq!(message("lookat", &parallel), "<lookat>: \"up\" is parallel to the direction of view");
        assert_eq!(message("rotate", &[("angle", "9")]), "the rotation axis is zero");
        assert_eq!(message("rotate", &[("x", "1")]), "missing required attribute \"angle\" in <rotate>");
        assert_eq!(message("scale", &[("x", "1"), ("value", "2")]), "<scale> has both \"value\" and x, y, z");
    }
}
