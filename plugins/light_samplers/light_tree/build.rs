//! Building the tree, from the top down, by surface area and orientation.

use super::cluster::Cluster;
use super::{LEAF, Node, Tree};
use lucerna_core::math::{Aabb, Vec3};
use rayon::prelude::*;

/// Bins per axis.
const BINS: usize = 12;

/// Lights below which a branch is built by one thread.
const ALONE: usize = 2048;

/// No way down is longer: it must fit into a trail.
const DEEPEST: u32 = 62;

/// A branch before it is laid out.
enum Branch {
    Leaf(u32),
    Inner(Box<[(Cluster, Branch); 2]>),
}

/// A light to be put into the tree.
struct Item {
    cluster: Cluster,
    center: Vec3,
    light: u32,
}

/// The nodes, and for each light the way down to it as [`Tree::trails`] has it. The same for any number of threads.
pub fn build(lights: &[Cluster]) -> (Vec<Node>, Vec<u64>) {
    // A leaf has no room for more; so many lights do not fit into memory either.
    let lights = &lights[..lights.len().min(LEAF as usize)];
    let mut items: Vec<Item> = (lights.iter().enumerate())
        .map(|(i, cluster)| Item { cluster: *cluster, center: cluster.bounds.center(), light: i as u32 })
        .collect();
    let mut ways = vec![0; lights.len()];
    if items.is_empty() {
        return (Vec::new(), ways);
    }
    let (cluster, root) = branch(&mut items, 0);
    let mut nodes = Vec::with_capacity(2 * lights.len());
    nodes.push(Node::new(&cluster, 0));
    lay_out(root, 0, (0, 0), &mut nodes, &mut ways);
    (nodes, ways)
}

fn branch(items: &mut [Item], depth: u32) -> (Cluster, Branch) {
    if let [item] = items {
        return (item.cluster, Branch::Leaf(item.light));
    }
    let middle = split(items, depth);
    let (left, right) = items.split_at_mut(middle);
    let (a, b) = if left.len().min(right.len()) > ALONE {
        rayon::join(|| branch(left, depth + 1), || branch(right, depth + 1))
    } else {
        (branch(left, depth + 1), branch(right, depth + 1))
    };
    (a.0.union(&b.0), Branch::Inner(Box::new([a, b])))
}

/// Writes the children of the node at `at`, whose way is so many bits long.
fn lay_out(branch: Branch, at: usize, (way, length): (u64, u32), nodes: &mut Vec<Node>, ways: &mut [u64]) {
    match branch {
        Branch::Leaf(light) => {
            nodes[at].next = light | LEAF;
            ways[light as usize] = way | 1 << length;
        }
        Branch::Inner(children) => {
            let first = nodes.len();
            nodes[at].next = first as u32;
            nodes.extend(children.iter().map(|(cluster, _)| Node::new(cluster, 0)));
            for (side, (_, child)) in children.into_iter().enumerate() {
                lay_out(child, first + side, (way | (side as u64) << length, length + 1), nodes, ways);
            }
        }
    }
}

/// Orders the lights so that those of the first side come first, and tells how many they are: at least one on each.
fn split(items: &mut [Item], depth: u32) -> usize {
    let centers = Aabb::of_points(items.iter().map(|item| item.center));
    let needed = items.len().next_power_of_two().trailing_zeros();
    if depth + needed < DEEPEST
        && let Some((axis, bin)) = best_split(items, &centers)
    {
        let middle = partition(items, |item| bin_of(item.center, &centers, axis) <= bin);
        if middle > 0 && middle < items.len() {
            return middle;
        }
    }
    // Coincident lights, or a way that has become too long: halves.
    let extent = centers.extent();
    let axis = if extent.max_element() == extent.x { 0 } else { 1 + usize::from(extent.z >= extent.y) };
    let middle = items.len() / 2;
    let order = |a: &Item, b: &Item| a.center[axis].total_cmp(&b.center[axis]).then(a.light.cmp(&b.light));
    items.select_nth_unstable_by(middle, order);
    middle
}

/// Moves what belongs to the first side to the front.
fn partition(items: &mut [Item], is_first: impl Fn(&Item) -> bool) -> usize {
    let mut middle = 0;
    for i in 0..items.len() {
        if is_first(&items[i]) {
            items.swap(i, middle);
            middle += 1;
        }
    }
    middle
}

fn bin_of(center: Vec3, centers: &Aabb, axis: usize) -> usize {
    // Halved, so that the extent of the largest boxes does not overflow.
    let (low, extent) = (0.5 * centers.min[axis], 0.5 * centers.max[axis] - 0.5 * centers.min[axis]);
    (((0.5 * center[axis] - low) / extent * BINS as f32) as usize).min(BINS - 1)
}

type Bins = [[Option<Cluster>; BINS]; 3];

fn joined(a: Option<Cluster>, b: Option<Cluster>) -> Option<Cluster> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.union(&b)),
        (a, b) => a.or(b),
    }
}

fn fill(items: &[Item], centers: &Aabb) -> Bins {
    let mut bins: Bins = [[None; BINS]; 3];
    for item in items {
        for (axis, bins) in bins.iter_mut().enumerate() {
            if centers.min[axis] < centers.max[axis] {
                let bin = &mut bins[bin_of(item.center, centers, axis)];
                *bin = joined(*bin, Some(item.cluster));
            }
        }
    }
    bins
}

/// The axis and the last bin of the first side with the least cost (Conty Estevez and Kulla 2018, equation 2).
fn best_split(items: &[Item], centers: &Aabb) -> Option<(usize, usize)> {
    // Chunks are joined in order, whoever filled them.
    const CHUNK: usize = 1 << 14;
    let bins = if items.len() > 2 * CHUNK {
        let parts: Vec<Bins> = items.par_chunks(CHUNK).map(|items| fill(items, centers)).collect();
        let together = |mut a: Bins, b: Bins| {
            for (a, b) in a.iter_mut().flatten().zip(b.iter().flatten()) {
                *a = joined(*a, *b);
            }
            a
        };
        parts.into_iter().fold([[None; BINS]; 3], together)
    } else {
        fill(items, centers)
    };
    let extent = centers.extent();
    let mut best = None;
    for (axis, bins) in bins.iter().enumerate() {
        let mut behind = [None; BINS];
        for bin in (0..BINS - 1).rev() {
            behind[bin] = joined(behind[bin + 1], bins[bin + 1]);
        }
        // Long boxes are cut across.
        let regular = f64::from(extent.max_element() / extent[axis]);
        let mut before = None;
        for bin in 0..BINS - 1 {
            before = joined(before, bins[bin]);
            let (Some(before), Some(behind)) = (&before, &behind[bin]) else { continue };
            let cost = regular * (before.cost() + behind.cost());
            if cost.is_finite() && best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, (axis, bin)));
            }
        }
    }
    best.map(|(_, split)| split)
}

/// Whether every node bounds its children, every light is found on its way, and no other way is marked.
pub fn validate(tree: &Tree) -> Result<(), String> {
    let mut seen = vec![false; tree.lights.len()];
    for (part, trail) in tree.trails.iter().enumerate().filter(|(_, trail)| **trail != 0) {
        let emitter = tree.first.partition_point(|first| *first as usize <= part) - 1;
        let (mut at, mut rest) = (0, *trail);
        while rest != 1 {
            let node = &tree.nodes[at];
            if node.next & LEAF != 0 {
                return Err(format!("the way to part {part} goes on below a leaf"));
            }
            let child = node.next as usize + (rest & 1) as usize;
            within(node, &tree.nodes[child]).map_err(|e| format!("nodes {at} and {child}: {e}"))?;
            (at, rest) = (child, rest >> 1);
        }
        let leaf = tree.nodes[at].next;
        let light = tree.lights.get((leaf & !LEAF) as usize).filter(|_| leaf & LEAF != 0);
        let light = light.ok_or_else(|| format!("the way to part {part} ends above the leaves"))?;
        if (light.emitter.0 as usize, light.part) != (emitter, Some(part as u32 - tree.first[emitter])) {
            return Err(format!("the way to part {part} leads to {light:?}"));
        }
        if std::mem::replace(&mut seen[(leaf & !LEAF) as usize], true) {
            return Err(format!("two ways lead to {light:?}"));
        }
    }
    match seen.iter().position(|seen| !seen) {
        Some(light) => Err(format!("no way leads to {:?}", tree.lights[light])),
        None => Ok(()),
    }
}

fn within(node: &Node, child: &Node) -> Result<(), String> {
    let bounds = |n: &Node| Aabb { min: Vec3::from_array(n.min), max: Vec3::from_array(n.max) };
    if !bounds(node).contains(&bounds(child)) {
        return Err("the box of the child is not inside".to_owned());
    }
    if child.intensity > node.intensity * (1.0 + 1e-5) || child.cos_e < node.cos_e {
        return Err("the child gives off more light".to_owned());
    }
    let between = node.axis.cross(child.axis).length().atan2(node.axis.dot(child.axis));
    let [outer, inner] = [node, child].map(|n| n.cos_o.acos());
    // The arc cosine loses half the digits near 0 and π.
    if node.cos_o > -1.0 + 1e-6 && between + inner > outer + 2e-3 {
        return Err(format!("the cone of the child, {inner} and {between} aside, is not inside {outer}"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use lucerna_core::interfaces::{Light, LightBounds, LightSelection, LightVertex};
    use lucerna_core::sampling::Pcg32;
    use lucerna_core::scene::EmitterId;
    use std::f32::consts::FRAC_PI_2;

    /// A tree over lights of one emitter.
    fn tree(clusters: &[Cluster]) -> Tree {
        let (nodes, trails) = build(clusters);
        let lights = (0..clusters.len() as u32).map(|part| Light { emitter: EmitterId(0), part: Some(part) }).collect();
        let first = vec![0, clusters.len() as u32];
        Tree { nodes, lights, first, trails, far: None, far_of: Vec::new(), p_far: 0.0 }
    }

    fn light(p: Vec3, axis: Vec3, intensity: f32) -> Cluster {
        let bounds = Aabb::of_points([p, p + Vec3::splat(1e-3)]);
        Cluster::of_light(&LightBounds { bounds, axis, theta_o: 0.0, theta_e: FRAC_PI_2, intensity }, 1.0)
    }

    fn random(pcg: &mut Pcg32) -> Vec3 {
        Vec3::new(pcg.next_f32(), pcg.next_f32(), pcg.next_f32()) - 0.5
    }

    /// Lights that tempt a builder to cut off one at a time: all in one place, in a line, each ten times as far as the
    /// one before, each ten times as strong.
    #[test]
    fn no_way_is_too_long_and_every_light_has_one() {
        let mut pcg = Pcg32::new(6, 1);
        let hundred_thousand = 100_000;
        let spread =
            (0..hundred_thousand).map(|_| light(random(&mut pcg), random(&mut pcg).normalize(), 1.0)).collect();
        let pile = vec![light(Vec3::ONE, Vec3::X, 1.0); hundred_thousand];
        let line = (0..5000).map(|i| light(Vec3::X * i as f32, Vec3::Y, 1.0)).collect();
        let farther = (0..70).map(|i| light(Vec3::X * 10f32.powi(i % 38 - 19), Vec3::Z, 1.0)).collect();
        let stronger = (0..70).map(|i| light(Vec3::X * i as f32, Vec3::Z, 10f32.powi(i % 70 - 35))).collect();
        let one = vec![light(Vec3::ONE, Vec3::X, 1.0)];
        let cases: [(&str, Vec<Cluster>); 6] = [
            ("spread", spread),
            ("pile", pile),
            ("line", line),
            ("farther", farther),
            ("stronger", stronger),
            ("one", one),
        ];
        for (name, clusters) in &cases {
            let tree = tree(clusters);
            assert_eq!(validate(&tree), Ok(()), "{name}");
            let longest = tree.trails.iter().map(|trail| 63 - trail.leading_zeros()).max();
            assert!(longest <= Some(DEEPEST), "{name}: {longest:?}");
            for _ in 0..200 {
                let from = LightVertex { p: random(&mut pcg) * 3.0, n: random(&mut pcg).normalize() };
                if let Some((light, pmf)) = tree.choose(&from, f64::from(pcg.next_f32())) {
                    assert_eq!(tree.pmf(&from, light), pmf, "{name}");
                }
            }
        }
        // Near lights are found: 3 % of them are this near, and bring about a third of the light.
        let (_, spread) = &cases[0];
        let (tree, mut near) = (tree(spread), 0);
        for i in 0..1000 {
            let from = LightVertex { p: spread[i * 7].bounds.min - spread[i * 7].axis * -0.01, n: Vec3::ZERO };
            let Some((light, _)) = tree.choose(&from, f64::from(pcg.next_f32())) else { continue };
            near += u32::from(spread[light.part.unwrap_or(0) as usize].bounds.min.distance(from.p) < 0.2);
        }
        assert!(near > 150, "{near}");
    }

    #[test]
    fn the_same_tree_for_any_number_of_threads() {
        let mut pcg = Pcg32::new(6, 1);
        let clusters: Vec<_> =
            (0..50_000).map(|_| light(random(&mut pcg), random(&mut pcg).normalize(), pcg.next_f32())).collect();
        let built = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| build(&clusters))
        };
        let (one, three) = (built(1), built(3));
        assert!(one.1 == three.1);
        let bits = |nodes: &[Node]| {
            let of = |n: &Node| {
                (n.min.map(f32::to_bits), n.axis.to_array().map(f32::to_bits), n.intensity.to_bits(), n.next)
            };
            nodes.iter().map(of).collect::<Vec<_>>()
        };
        assert!(bits(&one.0) == bits(&three.0));
    }

    /// What is wrong in a tree is told.
    #[test]
    fn validation_finds_damage() {
        let mut pcg = Pcg32::new(6, 1);
        let clusters: Vec<_> = (0..100).map(|_| light(random(&mut pcg), random(&mut pcg).normalize(), 1.0)).collect();
        let damages: [fn(&mut Tree); 5] = [
            |tree| tree.nodes[5].max = [9.0; 3],
            |tree| tree.nodes[7].axis = -tree.nodes[7].axis,
            |tree| tree.nodes[9].intensity = 1e9,
            |tree| tree.trails.swap(3, 4),
            |tree| tree.trails[3] = 0,
        ];
        for (i, damage) in damages.into_iter().enumerate() {
            let mut tree = tree(&clusters);
            damage(&mut tree);
            assert!(validate(&tree).is_err(), "{i}");
        }
    }
}
