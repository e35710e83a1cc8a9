#!/usr/bin/env python3
"""Writes plugins/bsdfs/conductor_materials.rs: RGB index of refraction of every metal preset of the reference.

In RGB mode the reference integrates the measured spectra of a preset to linear sRGB without a white point. This asks
it for the results, so that the table is made of its own numbers.

    python3 reference/conductor_table.py > plugins/bsdfs/conductor_materials.rs
"""

import os

import mitsuba as mi

mi.set_variant("scalar_rgb")
mi.set_log_level(mi.LogLevel.Error)


def rgb(values):
    return "[" + ", ".join(f"{float(v):.7g}" if float(v) % 1 else f"{float(v):.1f}" for v in values) + "]"


def main():
    folder = os.path.join(os.path.dirname(mi.__file__), "data", "ior")
    names = sorted({f.removesuffix(".eta.spd") for f in os.listdir(folder) if f.endswith(".eta.spd")})
    print("//! RGB index of refraction of the metals (and a few others) of the reference's `data/ior`.")
    print("//!")
    print("//! Made by `reference/conductor_table.py`; not to be changed by hand.")
    print()
    print("/// One material.")
    print("#[derive(Clone, Copy, Debug)]")
    print("pub struct Metal {")
    print("    /// The name, letter case significant.")
    print("    pub name: &'static str,")
    print("    /// Real part of the index per channel of linear sRGB.")
    print("    pub eta: [f32; 3],")
    print("    /// Imaginary part.")
    print("    pub k: [f32; 3],")
    print("}")
    print()
    print("/// All materials by name.")
    print("#[rustfmt::skip]")
    print("#[allow(clippy::approx_constant, clippy::excessive_precision)]")
    print("pub const METALS: &[Metal] = &[")
    for name in names:
        params = mi.traverse(mi.load_dict({"type": "conductor", "material": name}))
        eta, k = params["eta.value"], params["k.value"]
        print(f'    Metal {{ name: "{name}", eta: {rgb(eta)}, k: {rgb(k)} }},')
    print("];")


if __name__ == "__main__":
    main()
