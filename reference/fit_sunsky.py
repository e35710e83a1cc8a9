"""Fits the sun's irradiance and limb darkening, and prints `plugins/emitters/sunsky/sun_fit.rs`.

    python reference/fit_sunsky.py > plugins/emitters/sunsky/sun_fit.rs

The reference renderer is only asked for radiances (its `sunsky` emitter with the sky off); the numbers printed are
least-squares coefficients. What is fitted, per integer turbidity and CIE channel (X, Y, Z, which unlike linear sRGB
are never negative), is the logarithm of the irradiance as a polynomial in the fourth root of the air mass (Kasten and
Young 1989); and the limb darkening as a polynomial in 1 - cos psi and the reddening ln(X / Z). The errors of both fits
go to the standard error output.
"""

import sys

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")

XYZ_TO_RGB = np.array(
    [[3.240479, -1.537150, -0.498535], [-0.969256, 1.875991, 0.041556], [0.055648, -0.204043, 1.057311]]
)
RGB_TO_XYZ = np.linalg.inv(XYZ_TO_RGB)
TURBIDITIES = np.arange(1, 11)
# Where the simple sun is tabulated by the reference: seen as the kinks of its piecewise linear elevation dependence.
NODES = np.linspace(2, 89, 30)
LOW = np.array([0.02, 0.1, 0.2, 0.35, 0.5, 0.75, 1, 1.25, 1.5, 1.75])
DEGREE = 8
LIMB_DEGREE = 4
REDDENING_DEGREE = 3
MAX_REDDENING = 4.0
REAL_APERTURE = 0.5358
WIDE_APERTURE = 60.0


def sun_direction(elevation):
    e = np.radians(elevation)
    return [np.cos(e), 0, np.sin(e)]


def radiance(directions, **parameters):
    emitter = mi.load_dict({"type": "sunsky", "sky_scale": 0.0, **parameters})
    directions = np.asarray(directions, dtype=np.float64)
    si = dr.zeros(mi.SurfaceInteraction3f, len(directions))
    si.wi = mi.Vector3f(*(-directions.T))
    return np.array(emitter.eval(si)).T.astype(np.float64)


def solid_angle(aperture):
    return 2 * np.pi * (1 - np.cos(np.radians(aperture / 2)))


def irradiance(turbidity, elevation, **parameters):
    """On a surface facing the sun, XYZ. A wide disc, as the reference loses digits of the real one's solid angle."""
    d = sun_direction(elevation)
    wide = radiance([d], turbidity=turbidity, sun_direction=d, sun_aperture=WIDE_APERTURE, **parameters)[0]
    return RGB_TO_XYZ @ wide * solid_angle(WIDE_APERTURE)


def across_the_disc(turbidity, elevation, mu):
    """XYZ at angles psi of cosine `mu` between the sun's surface normal and the view, at the centre's elevation."""
    centre = np.array(sun_direction(elevation))
    gamma = np.arcsin(np.sqrt(1 - mu**2) * np.sin(np.radians(REAL_APERTURE / 2)))
    d = np.cos(gamma)[:, None] * centre + np.sin(gamma)[:, None] * np.array([0, 1, 0])
    return radiance(d, turbidity=turbidity, sun_direction=sun_direction(elevation), complex_sun=True) @ RGB_TO_XYZ.T


def air_mass(elevation):
    return 1 / (np.sin(np.radians(elevation)) + 0.50572 * (elevation + 6.07995) ** -1.6364)


def coordinate(elevation):
    """In [-1, 1], from the zenith to the horizon."""
    root, horizon = air_mass(elevation) ** 0.25, air_mass(0.0) ** 0.25
    return 2 * (root - 1) / (horizon - 1) - 1


def fit_irradiance(simple, elevations, low):
    """Coefficients [turbidity, channel, power] of ln E; `low` continues below the first node."""
    brightest = simple.max(axis=(0, 1))
    coefficients = np.zeros((len(TURBIDITIES), 3, DEGREE + 1))
    for t in range(len(TURBIDITIES)):
        for c in range(3):
            e = np.concatenate([LOW, elevations])
            v = np.concatenate([low[t, :, c], simple[t, :, c]])
            weight = np.clip(30 * v / brightest[c], 3e-3, 1) * np.where(e < NODES[0], 0.02, 1)
            good = v > 1e-9 * brightest[c]
            fitted = np.polynomial.chebyshev.chebfit(coordinate(e[good]), np.log(v[good]), DEGREE, w=weight[good])
            coefficients[t, c] = np.polynomial.chebyshev.cheb2poly(fitted)
    return np.round(coefficients, 5)


def evaluate(coefficients, elevation):
    s = coordinate(np.atleast_1d(elevation))
    powers = s[:, None] ** np.arange(DEGREE + 1)
    return np.exp(np.einsum("tcp,ep->tec", coefficients, powers))


def reddening(xyz):
    return np.clip(np.log(np.maximum(xyz[..., 0] / xyz[..., 2], 1e-9)), 0, MAX_REDDENING)


def fit_limb(coefficients):
    """Coefficients [channel, power of 1 - mu, power of reddening] of radiance over mean radiance."""
    mu = np.linspace(0.02, 1, 50)
    elevations = np.array([2, 3, 4, 6, 8, 11, 15, 20, 30, 45, 60, 75, 88.0])
    rows, values, weights, bulk = [], [[], [], []], [], []
    x = 1 - mu
    for t in TURBIDITIES:
        for e in elevations:
            mean = evaluate(coefficients, e)[t - 1, 0]
            if mean[1] < 1e-2 * evaluate(coefficients, 88.0)[0, 0, 1]:
                continue
            disc = across_the_disc(t, e, mu)
            q = reddening(mean)
            basis = np.stack([x**i * q**j for i in range(LIMB_DEGREE + 1) for j in range(REDDENING_DEGREE + 1)], axis=1)
            lit = disc[:, 1] > 0
            for c in range(3):
                values[c].append(disc[lit, c] * reference_disc(t, e) / mean[c])
            rows.append(basis[lit])
            weights.append(np.sqrt(mu[lit]))
            bulk.append((mu[lit] > 0.1) & (t <= 6) & (e >= 3))
    rows, weights = np.concatenate(rows), np.concatenate(weights)
    limb, errors, bulk = [], [], np.concatenate(bulk)
    for c in range(3):
        v = np.concatenate(values[c])
        fitted = np.round(np.linalg.lstsq(rows * weights[:, None], v * weights, rcond=None)[0], 6)
        errors.append(np.abs(rows @ fitted - v) / v.max())
        limb.append(fitted.reshape(LIMB_DEGREE + 1, REDDENING_DEGREE + 1))
    errors = np.array(errors)
    print(f"limb darkening: largest error over centre {errors.max():.4%}, turbidity <= 6 and elevation >= 3: "
          f"{errors[:, bulk].max():.4%}, rms {np.sqrt((errors**2).mean()):.4%}", file=sys.stderr)
    return np.array(limb)


def reference_disc(turbidity, elevation):
    """Solid angle the reference takes the real disc for, from how radiance changes with the aperture.

    It loses digits there (1 - cos in single precision): this number, not the exact one, turns its radiance into
    irradiance.
    """
    d = sun_direction(elevation)
    real, wide = (
        radiance([d], turbidity=turbidity, sun_direction=d, sun_aperture=a)[0, 0] for a in (REAL_APERTURE, WIDE_APERTURE)
    )
    return solid_angle(WIDE_APERTURE) * wide / real


def rust(name, doc, kind, array):
    """A constant with one innermost-but-one array per line."""

    def number(v):
        return f"{v:.6f}".rstrip("0") + ("0" if v == round(v) else "")

    def flat(a):
        return number(a) if a.ndim == 0 else "[" + ", ".join(map(flat, a)) + "]"

    def nested(a, indent):
        if a.ndim <= 1:
            return f"{indent}{flat(a)},\n"
        return f"{indent}[\n" + "".join(nested(b, indent + "    ") for b in a) + f"{indent}],\n"

    body = "".join(nested(a, "    ") for a in array)
    return f"/// {doc}\n#[rustfmt::skip]\npub const {name}: {kind} = [\n{body}];\n"


def main():
    simple = np.array([[irradiance(t, e) for e in NODES] for t in TURBIDITIES])
    # Below the first node only the limb-darkened sun goes on; its centre is scaled to meet the simple one.
    centre = lambda t, e: across_the_disc(t, e, np.array([1.0]))[0]
    low = np.array([[centre(t, e) * simple[t - 1, 0] / centre(t, NODES[0]) for e in LOW] for t in TURBIDITIES])
    coefficients = fit_irradiance(simple, NODES, low)
    fitted = evaluate(coefficients, NODES)
    rgb_error = np.abs((fitted - simple) @ XYZ_TO_RGB.T) / (simple @ XYZ_TO_RGB.T).max(axis=2, keepdims=True)
    bright = simple[..., 1] > 0.01 * simple[..., 1].max()
    print(f"irradiance where above 1 %: largest error over largest channel {rgb_error[bright].max():.4%}", file=sys.stderr)
    print(f"irradiance anywhere: {rgb_error.max():.4%}; XYZ {np.abs(fitted / simple - 1)[bright].max():.4%}", file=sys.stderr)
    limb = fit_limb(coefficients)
    print("//! Coefficients of the sun, fitted to measured radiances by `reference/fit_sunsky.py`; not written by hand.\n")
    print(
        rust(
            "IRRADIANCE",
            "Natural logarithm of the sun's irradiance: `[turbidity − 1][X, Y, Z][power of the air mass coordinate]`.",
            f"[[[f32; {DEGREE + 1}]; 3]; 10]",
            coefficients,
        )
    )
    print(
        rust(
            "LIMB",
            "Radiance over mean radiance: `[X, Y, Z][power of 1 − cos ψ][power of the reddening ln(X/Z)]`.",
            f"[[[f32; {REDDENING_DEGREE + 1}]; {LIMB_DEGREE + 1}]; 3]",
            limb,
        ),
        end="",
    )


if __name__ == "__main__":
    main()
