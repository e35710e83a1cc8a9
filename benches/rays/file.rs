//! The file that both tracers read, so that they trace the same rays against the same triangles.
//!
//! All numbers are little-endian and of 32 bits:
//!
//! | | |
//! |---|---|
//! | 8 bytes | `LUCRAYS1` |
//! | u32 × 3 | numbers of vertices V, triangles T and ray sets S |
//! | f32 × 3 V | vertices |
//! | u32 × 3 T | corners of triangles, as indices of vertices |
//! | S times | |
//! | 16 bytes | name, ASCII, filled up with zeros |
//! | u32 × 2 | 0: what is hit first, 1: is anything hit; number of rays R |
//! | f32 × 8 R | origin, direction, and the ends of the interval of the parameter t, both of which are outside |

use crate::support::{mesh::Mesh, rays::RaySet};
use bytemuck::pod_collect_to_vec;
use lucerna::core::accel::{NO_TRIANGLE, Ray};
use lucerna::core::math::Vec3;
use std::io::{self, Read, Write};

const MAGIC: &[u8; 8] = b"LUCRAYS1";

#[cfg(target_endian = "big")]
compile_error!("the file is little-endian, and so must be the machine");

/// Writes the file.
pub fn write(to: &mut impl Write, mesh: &Mesh, sets: &[RaySet]) -> io::Result<()> {
    to.write_all(MAGIC)?;
    to.write_all(bytemuck::bytes_of(&[mesh.positions.len(), mesh.triangles.len(), sets.len()].map(|n| n as u32)))?;
    let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|p| p.to_array()).collect();
    to.write_all(bytemuck::cast_slice(&positions))?;
    to.write_all(bytemuck::cast_slice(&mesh.triangles))?;
    for set in sets {
        let mut name = [0; 16];
        name[..set.name.len()].copy_from_slice(set.name.as_bytes());
        to.write_all(&name)?;
        to.write_all(bytemuck::bytes_of(&[u32::from(set.any), set.rays.len() as u32]))?;
        for Ray { o, d, t_min, t_max, .. } in &set.rays {
            to.write_all(bytemuck::bytes_of(&[o.x, o.y, o.z, d.x, d.y, d.z, *t_min, *t_max]))?;
        }
    }
    Ok(())
}

/// Rays of one kind, packed as in the file.
pub struct PackedSet {
    pub name: String,
    pub any: bool,
    rays: Vec<[f32; 8]>,
}

impl PackedSet {
    pub fn len(&self) -> usize {
        self.rays.len()
    }

    pub fn chunks(&self, size: usize) -> impl Iterator<Item = &[[f32; 8]]> {
        self.rays.chunks(size)
    }
}

/// A ray of the file.
#[inline]
pub fn ray([ox, oy, oz, dx, dy, dz, t_min, t_max]: [f32; 8]) -> Ray {
    Ray { o: Vec3::new(ox, oy, oz), d: Vec3::new(dx, dy, dz), t_min, t_max, ends: [NO_TRIANGLE; 2] }
}

/// Reads the file.
pub fn read(from: &mut impl Read) -> io::Result<(Mesh, Vec<PackedSet>)> {
    let mut bytes = |count: usize| -> io::Result<Vec<u8>> {
        let mut buffer = Vec::new();
        let found = from.by_ref().take(count as u64).read_to_end(&mut buffer)?;
        if found < count { Err(io::ErrorKind::UnexpectedEof.into()) } else { Ok(buffer) }
    };
    if bytes(MAGIC.len())? != MAGIC {
        return Err(io::Error::other("not a file of rays"));
    }
    let counts: Vec<u32> = pod_collect_to_vec(&bytes(12)?);
    let positions: Vec<[f32; 3]> = pod_collect_to_vec(&bytes(12 * counts[0] as usize)?);
    let positions = positions.into_iter().map(Vec3::from_array).collect();
    let mesh = Mesh { positions, triangles: pod_collect_to_vec(&bytes(12 * counts[1] as usize)?) };
    let mut set = || {
        let name = String::from_utf8_lossy(&bytes(16)?).trim_end_matches('\0').to_owned();
        let head: Vec<u32> = pod_collect_to_vec(&bytes(8)?);
        Ok(PackedSet { name, any: head[0] != 0, rays: pod_collect_to_vec(&bytes(32 * head[1] as usize)?) })
    };
    let sets = (0..counts[2]).map(|_| set()).collect::<io::Result<_>>()?;
    Ok((mesh, sets))
}
