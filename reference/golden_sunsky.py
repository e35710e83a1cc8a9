"""Measures the reference renderer's `sunsky` and prints `plugins/emitters/sunsky/golden.rs`.

python reference/golden_sunsky.py > plugins/emitters/sunsky/golden.rs
"""

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")

TURBIDITIES = [1.5, 3, 8.2]
ALBEDOS = [[0.1, 0.1, 0.1], [0.8, 0.3, 0.05]]
ELEVATIONS = [4, 35, 80]
DIRECTIONS = 20

SUN_TURBIDITIES = [1, 2.5, 3, 6.3, 10]
SUN_ELEVATIONS = [1, 3, 10, 27, 50, 85]
LIMB_TURBIDITIES = [1, 2.5, 6.3]
LIMB_ELEVATIONS = [4, 30, 70]
LIMB_COSINES = [1, 0.7, 0.3]

PLACES = [  # latitude, longitude, timezone, year, month, day, hour, minute, second
    (35.6894, 139.6917, 9, 2010, 7, 10, 15, 0, 0),
    (35.6894, 139.6917, 9, 2010, 7, 10, 6, 30, 0),
    (50.0, 14.4, 1, 2024, 3, 20, 12, 0, 0),
    (50.0, 14.4, 2, 2024, 6, 21, 18, 45, 30),
    (-33.9, 151.2, 10, 2000, 1, 1, 12, 0, 0),
    (-33.9, 151.2, 10, 2019, 12, 31, 9, 15, 59.5),
    (0.0, 0.0, 0, 1999, 2, 28, 10, 20, 0),
    (68.0, 20.0, 1, 2035, 6, 1, 0, 30, 0),
    (40.7, -74.0, -5, 1985, 11, 5, 11.25, 5, 10),
    (-54.8, -68.3, -3, 2023, 9, 15, 16, 0, 0),
]


def sun_direction(elevation):
    e = np.radians(elevation)
    return [np.cos(e), 0, np.sin(e)]


def directions():
    """A golden-angle spiral over the upper hemisphere, uniform in solid angle."""
    i = np.arange(DIRECTIONS)
    z = (i + 0.5) / DIRECTIONS
    r, phi = np.sqrt(1 - z * z), 2.399963 * i
    return np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=1)


def radiance(d, **parameters):
    emitter = mi.load_dict({"type": "sunsky", **parameters})
    si = dr.zeros(mi.SurfaceInteraction3f, len(d))
    si.wi = mi.Vector3f(*(-np.asarray(d, dtype=np.float64).T))
    return np.array(emitter.eval(si)).T.astype(np.float64)


def sky(turbidity, albedo, elevation):
    return radiance(
        directions(),
        turbidity=turbidity,
        albedo={"type": "rgb", "value": albedo},
        sun_direction=sun_direction(elevation),
        sun_scale=0.0,
    )


def sun(turbidity, elevation):
    """Irradiance on a surface facing the sun, from a disc so wide that its solid angle keeps all digits."""
    d = sun_direction(elevation)
    wide = radiance([d], turbidity=turbidity, sun_direction=d, sun_aperture=60.0, sky_scale=0.0)[0]
    return wide * 2 * np.pi * (1 - np.cos(np.radians(30)))


def limb(turbidity, elevation):
    """Radiance across the disc over that of the simple sun, whose aperture does not matter."""
    mu, s = np.array(LIMB_COSINES), np.array(sun_direction(elevation))
    gamma = np.arcsin(np.sqrt(1 - mu**2) * np.sin(np.radians(0.5358 / 2)))
    d = np.cos(gamma)[:, None] * s + np.sin(gamma)[:, None] * np.array([0, 1, 0])
    common = dict(turbidity=turbidity, sun_direction=sun_direction(elevation), sky_scale=0.0)
    return radiance(d, complex_sun=True, **common) / radiance(d, **common)


def position(place):
    names = ["latitude", "longitude", "timezone", "year", "month", "day", "hour", "minute", "second"]
    parameters = {n: int(v) if n in ("year", "month", "day") else float(v) for n, v in zip(names, place)}
    emitter = mi.load_dict({"type": "sunsky", **parameters})
    return np.array(mi.traverse(emitter)["sun_direction"]).ravel()


def number(v):
    s = np.format_float_positional(v, 7, unique=False, fractional=False, trim="0")
    return s if "." in s else s + ".0"


def flat(a):
    return number(a) if np.ndim(a) == 0 else "[" + ", ".join(flat(b) for b in a) + "]"


def table(name, doc, kind, a):
    """A constant with one innermost array per line."""
    def nested(a, indent):
        if np.ndim(a) == 1:
            return f"{indent}{flat(a)},\n"
        return f"{indent}[\n" + "".join(nested(b, indent + "    ") for b in a) + f"{indent}],\n"

    body = "".join(nested(b, "    ") for b in a)
    print(f"\n/// {doc}\n#[rustfmt::skip]\npub const {name}: {kind} = [\n{body}];")


def constant(name, doc, kind, a):
    print(f"\n/// {doc}\n#[rustfmt::skip]\npub const {name}: {kind} = {flat(a)};")


def main():
    print("//! The reference renderer's sun and sky, measured by `reference/golden_sunsky.py`; not written by hand.")
    constant("TURBIDITIES", "Turbidities of [`SKY`].", "[f32; 3]", TURBIDITIES)
    constant("ALBEDOS", "Ground albedos of [`SKY`].", "[[f32; 3]; 2]", ALBEDOS)
    constant("ELEVATIONS", "Elevations of the sun of [`SKY`], degrees; its azimuth is 0.", "[f32; 3]", ELEVATIONS)
    values = [[[sky(t, a, e) for e in ELEVATIONS] for a in ALBEDOS] for t in TURBIDITIES]
    table("SKY", "Sky radiance: `[turbidity][albedo][elevation][direction]`.", f"[[[[[f32; 3]; {DIRECTIONS}]; 3]; 2]; 3]", values)
    constant("SUN_TURBIDITIES", "Turbidities of [`SUN`].", "[f32; 5]", SUN_TURBIDITIES)
    constant("SUN_ELEVATIONS", "Elevations of [`SUN`], degrees.", "[f32; 6]", SUN_ELEVATIONS)
    values = [[sun(t, e) for e in SUN_ELEVATIONS] for t in SUN_TURBIDITIES]
    table("SUN", "Irradiance of the sun on a surface facing it: `[turbidity][elevation]`.", "[[[f32; 3]; 6]; 5]", values)
    constant("LIMB_TURBIDITIES", "Turbidities of [`LIMB`].", "[f32; 3]", LIMB_TURBIDITIES)
    constant("LIMB_ELEVATIONS", "Elevations of [`LIMB`], degrees.", "[f32; 3]", LIMB_ELEVATIONS)
    constant("LIMB_COSINES", "Cosines ψ of [`LIMB`].", "[f32; 3]", LIMB_COSINES)
    values = [[limb(t, e) for e in LIMB_ELEVATIONS] for t in LIMB_TURBIDITIES]
    table("LIMB", "Limb-darkened over simple radiance: `[turbidity][elevation][cosine]`.", "[[[[f32; 3]; 3]; 3]; 3]", values)
    doc = "Latitude, longitude, timezone, year, month, day, hour, minute, second and the direction of the sun."
    table("POSITIONS", doc, f"[[f64; 12]; {len(PLACES)}]", np.array([[*p, *position(p)] for p in PLACES]))


if __name__ == "__main__":
    main()
