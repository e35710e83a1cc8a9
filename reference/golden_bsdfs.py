#!/usr/bin/env python3
"""Writes plugins/bsdfs/golden.txt: what the BSDFs of the reference renderer give for fixed random inputs.

    python3 reference/golden_bsdfs.py > plugins/bsdfs/golden.txt

Line by line, with a tab between fields and a blank between numbers:

    case    NAME
    bsdf/texture/end, float, boolean, string, rgb: the object, nested by order
    hit     n frame.s frame.t frame.n dp_du dp_dv                            (world space; only where it is not trivial)
    sample  mode wi u1 u2  ->  wo weight pdf eta lobe                        (or "none")
    eval    mode wi wo  ->  value pdf
    null    wi  ->  transmission diffuse_reflectance
"""

import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
mi.set_log_level(mi.LogLevel.Error)

ROWS = int(sys.argv[1]) if len(sys.argv) > 1 else 12
RGB = [0.9, 0.5, 0.1]


def rgb(*v):
    return {"type": "rgb", "value": list(v)}


def b(kind, *children, **parameters):
    """A BSDF as (kind, parameters, children)."""
    return (kind, parameters, children)


def heights():
    return mi.Bitmap(np.random.RandomState(3).rand(4, 4, 1).astype(np.float32))


def to_dict(bsdf):
    kind, parameters, children = bsdf
    out = {"type": kind}
    for i, child in enumerate(children):
        out[f"child_{i}"] = to_dict(child)
    for name, value in parameters.items():
        if name == "gradient":
            out["height"] = {"type": "bitmap", "raw": True, "bitmap": heights()}
        else:
            out[name] = value
    return out


def cases():
    diffuse = b("diffuse", reflectance=rgb(*RGB))
    metal = b("roughconductor", alpha_u=0.3, alpha_v=0.1)
    plastic = b("plastic", diffuse_reflectance=rgb(0.2, 0.6, 0.4))
    yield "diffuse", diffuse
    yield "conductor none", b("conductor")
    yield "conductor Au", b("conductor", material="Au")
    yield "conductor eta k", b("conductor", eta=rgb(0.2, 1.0, 1.4), k=rgb(3.9, 2.4, 2.1), specular_reflectance=rgb(*RGB))
    for distribution in ["beckmann", "ggx"]:
        for alpha in [0.05, 0.3, 1.0]:
            yield f"roughconductor {distribution} {alpha}", b(
                "roughconductor", material="Cu", distribution=distribution, alpha=alpha
            )
            yield f"roughdielectric {distribution} {alpha}", b("roughdielectric", distribution=distribution, alpha=alpha)
            yield f"roughplastic {distribution} {alpha}", b(
                "roughplastic", distribution=distribution, alpha=alpha, diffuse_reflectance=rgb(*RGB)
            )
        yield f"roughconductor {distribution} anisotropic", b(
            "roughconductor", distribution=distribution, alpha_u=0.05, alpha_v=0.4
        )
        for anisotropic in [dict(alpha=0.2), dict(alpha_u=0.1, alpha_v=0.3)]:
            name = f"{distribution} {list(anisotropic)[0]} all normals"
            yield f"roughconductor {name}", b(
                "roughconductor", distribution=distribution, sample_visible=False, **anisotropic
            )
            yield f"roughdielectric {name}", b(
                "roughdielectric", distribution=distribution, sample_visible=False, **anisotropic
            )
    yield "roughdielectric dense outside, tinted", b(
        "roughdielectric",
        int_ior=1.0,
        ext_ior=1.8,
        alpha=0.25,
        specular_reflectance=rgb(*RGB),
        specular_transmittance=rgb(0.3, 0.8, 0.7),
    )
    yield "roughplastic nonlinear", b(
        "roughplastic", nonlinear=True, int_ior=1.9, diffuse_reflectance=rgb(*RGB), specular_reflectance=rgb(0.5, 0.6, 0.7)
    )
    yield "roughplastic all normals", b("roughplastic", alpha=0.2, sample_visible=False)
    yield "roughplastic dense outside", b("roughplastic", int_ior=1.0, ext_ior=1.5, alpha=0.3)
    yield "dielectric", b("dielectric")
    yield "dielectric tinted", b(
        "dielectric",
        int_ior="diamond",
        ext_ior="water",
        specular_reflectance=rgb(*RGB),
        specular_transmittance=rgb(0.3, 0.8, 0.7),
    )
    yield "dielectric matched", b("dielectric", int_ior=1.3, ext_ior=1.3)
    yield "thindielectric", b("thindielectric", specular_transmittance=rgb(0.3, 0.8, 0.7))
    yield "plastic", plastic
    yield "plastic nonlinear", b(
        "plastic", nonlinear=True, int_ior=1.9, diffuse_reflectance=rgb(*RGB), specular_reflectance=rgb(0.5, 0.6, 0.7)
    )
    yield "null", b("null")
    yield "twosided", b("twosided", diffuse)
    yield "twosided two", b("twosided", diffuse, metal)
    yield "twosided transmitting", b("twosided", b("roughdielectric", alpha=0.2), allow_transmission=True)
    yield "mask", b("mask", plastic, opacity=0.3)
    yield "mask opaque", b("mask", diffuse, opacity=1.0)
    yield "mask thin", b("mask", b("thindielectric"), opacity=0.6)
    yield "blend smooth", b("blendbsdf", diffuse, metal, weight=0.35)
    yield "blend delta", b("blendbsdf", plastic, b("dielectric"), weight=0.35)
    yield "blend null", b("blendbsdf", b("null"), b("mask", metal, opacity=0.5), weight=0.7)
    yield "blend first", b("blendbsdf", diffuse, metal, weight=0.0)
    yield "blend second", b("blendbsdf", diffuse, metal, weight=1.0)
    for name, options in {
        "": {},
        " kept": {"flip_invalid_normals": False},
        " hard": {"use_shadowing_function": False},
    }.items():
        yield "normalmap" + name, b("normalmap", metal, normalmap=rgb(0.8, 0.4, 0.7), **options)
        yield "bumpmap" + name, b("bumpmap", metal, gradient=True, scale=0.3, **options)
    yield "normalmap glass", b("normalmap", b("dielectric"), normalmap=rgb(0.6, 0.4, 0.9))
    yield "normalmap flat", b("normalmap", diffuse, normalmap=rgb(0.5, 0.5, 1.0))
    yield "principled", b("principled", base_color=rgb(*RGB))
    yield "principled metal", b("principled", base_color=rgb(*RGB), metallic=0.8, roughness=0.3, anisotropic=0.7)
    yield "principled glass", b("principled", base_color=rgb(*RGB), spec_trans=0.7, roughness=0.4, eta=1.6)
    yield "principled all", b(
        "principled",
        base_color=rgb(*RGB),
        metallic=0.2,
        spec_trans=0.3,
        roughness=0.35,
        anisotropic=0.5,
        spec_tint=0.6,
        sheen=0.7,
        sheen_tint=0.4,
        flatness=0.5,
        clearcoat=0.8,
        clearcoat_gloss=0.3,
        specular=0.8,
        main_specular_sampling_rate=0.7,
        clearcoat_sampling_rate=1.5,
        diffuse_reflectance_sampling_rate=0.6,
    )
    yield "principled coat", b("principled", base_color=rgb(*RGB), clearcoat=1.0, clearcoat_gloss=0.9, sheen=0.5)
    yield "principled low index", b("principled", base_color=rgb(*RGB), spec_tint=0.5, metallic=0.3, eta=0.7)


def numbers(*values):
    out = []
    for value in values:
        if isinstance(value, (int, float)):
            out.append(float(value))
        else:
            out.extend(float(v) for v in value)
    return " ".join(f"{v:.8g}" for v in out)


def write_object(bsdf, si):
    kind, parameters, children = bsdf
    print(f"bsdf\t{kind}")
    for child in children:
        write_object(child, si)
    for name, value in parameters.items():
        if name == "gradient":
            texture = mi.load_dict({"type": "bitmap", "raw": True, "bitmap": heights()})
            print(f"texture\tfixed\nrgb\tgradient\t{numbers(texture.eval_1_grad(si), 0.0)}\nend")
        elif isinstance(value, dict):
            print(f"rgb\t{name}\t{numbers(value['value'])}")
        elif isinstance(value, bool):
            print(f"boolean\t{name}\t{str(value).lower()}")
        elif isinstance(value, str):
            print(f"string\t{name}\t{value}")
        else:
            print(f"float\t{name}\t{value}")
    print("end")


def hit(trivial):
    si = mi.SurfaceInteraction3f()
    si.uv = [0.3, 0.4]
    if trivial:
        si.n, si.sh_frame, si.dp_du, si.dp_dv = [0, 0, 1], mi.Frame3f([0, 0, 1]), [1, 0, 0], [0, 1, 0]
        si.sh_frame.s, si.sh_frame.t = [1, 0, 0], [0, 1, 0]
        return si
    n = np.array([0.3, -0.5, 0.8])
    n /= np.linalg.norm(n)
    shading = n + np.array([0.1, 0.05, -0.1])
    shading /= np.linalg.norm(shading)
    dp_du = np.array([1.3, 0.2, -0.4])
    s = dp_du - shading * shading.dot(dp_du)
    s /= np.linalg.norm(s)
    si.n, si.dp_du, si.dp_dv = list(n), list(dp_du), list(0.7 * np.cross(n, dp_du) + 0.2 * dp_du)
    si.sh_frame = mi.Frame3f(list(s), list(np.cross(shading, s)), list(shading))
    print("hit\t" + numbers(si.n, si.sh_frame.s, si.sh_frame.t, si.sh_frame.n, si.dp_du, si.dp_dv))
    return si


def main():
    for index, (name, description) in enumerate(cases()):
        rng = np.random.RandomState(100 + index)
        kind = description[0]
        print(f"case\t{name}")
        bsdf = mi.load_dict(to_dict(description))
        si = hit(kind not in ("bumpmap", "normalmap"))
        write_object(description, si)
        two_sided = any(mi.has_flag(bsdf.flags(), f) for f in (mi.BSDFFlags.Transmission, mi.BSDFFlags.BackSide))
        for row in range(ROWS):
            z = 1 - rng.rand() ** 0.7 if row % 4 else 0.02 + 0.1 * rng.rand()
            if (two_sided or kind in ("bumpmap", "normalmap")) and rng.rand() < 0.4:
                z = -z
            phi = 2 * np.pi * rng.rand()
            r = np.sqrt(1 - z * z)
            si.wi = mi.Vector3f(r * np.cos(phi), r * np.sin(phi), z)
            mode = "radiance" if row % 3 else "importance"
            context = mi.BSDFContext(mi.TransportMode.Radiance if row % 3 else mi.TransportMode.Importance)
            u1, u2 = float(np.float32(rng.rand())), mi.Point2f(rng.rand(2))
            bs, weight = bsdf.sample(context, si, u1, u2)
            left = numbers(si.wi, u1, u2)
            if max(weight) > 0:
                lobe = bs.sampled_type & 0x7F
                print(f"sample\t{mode}\t{left}\t{numbers(bs.wo, weight, bs.pdf, bs.eta)} {lobe}")
            else:
                print(f"sample\t{mode}\t{left}\tnone")
            # Directions near the sampled one see the lobe; others see what is far from it.
            if row % 2 and max(weight) > 0:
                wo = np.array(bs.wo) + 0.05 * rng.randn(3)
            else:
                wo = rng.randn(3)
                if not two_sided and rng.rand() < 0.8:
                    wo[2] = abs(wo[2])
            wo = mi.Vector3f(wo / np.linalg.norm(wo))
            value, pdf = bsdf.eval_pdf(context, si, wo)
            print(f"eval\t{mode}\t{numbers(si.wi, wo)}\t{numbers(value, pdf)}")
            if row < 2:
                null = bsdf.eval_null_transmission(si)
                print(f"null\t{numbers(si.wi)}\t{numbers(null, bsdf.eval_diffuse_reflectance(si))}")


if __name__ == "__main__":
    main()
