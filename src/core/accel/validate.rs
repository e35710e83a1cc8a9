//! Does a tree keep its promises?

use super::builders::MAX_DEPTH;
use super::traverse::Tree;
use super::wide::{WIDTH, Word};
use crate::math::Aabb;
use std::collections::HashSet;

/// Walks the whole tree; see [`Accel::validate`](super::Accel::validate).
pub fn validate(tree: &Tree) -> Result<(), String> {
    let Some(root) = tree.root else {
        let empty = tree.nodes.is_empty() && tree.packs.is_empty() && tree.primitives.is_empty();
        return if empty { Ok(()) } else { Err("geometry without a root".into()) };
    };
    let mut seen = Seen { words: HashSet::new(), ids: HashSet::new() };
    seen.visit(tree, root, &tree.frame.enclose(&tree.bounds), 0)?;
    let words = tree.nodes.len() + tree.packs.len() + tree.primitives.len();
    if seen.words.len() != words {
        return Err(format!("{} of {words} nodes and leaves can be reached", seen.words.len()));
    }
    Ok(())
}

struct Seen {
    words: HashSet<u32>,
    ids: HashSet<u32>,
}

impl Seen {
    /// Checks what is below `word`, which must lie in `outer`.
    fn visit(&mut self, tree: &Tree, word: Word, outer: &Aabb, depth: usize) -> Result<(), String> {
        if depth > MAX_DEPTH {
            return Err(format!("{word:?} is {depth} levels deep"));
        }
        if !self.words.insert(word.0) {
            return Err(format!("{word:?} has two parents"));
        }
        let missing = || format!("{word:?} does not exist");
        if word.is_node() {
            let node = tree.nodes.get(word.index()).ok_or_else(missing)?;
            let mut children = 0;
            for slot in 0..WIDTH {
                let bounds = node.bounds(slot);
                if bounds.is_empty() {
                    continue;
                }
                if !outer.contains(&bounds) {
                    return Err(format!("child {slot} of {word:?} sticks out: {bounds:?} of {outer:?}"));
                }
                children += 1;
                self.visit(tree, node.children[slot], &bounds, depth + 1)?;
            }
            return if children > 1 { Ok(()) } else { Err(format!("{word:?} has {children} children")) };
        }
        if word.is_primitive() {
            let (id, primitive) = tree.primitives.get(word.index()).ok_or_else(missing)?;
            return self.leaf(*id, &tree.frame.enclose(&primitive.bounds()), outer);
        }
        let pack = tree.packs.get(word.index()).ok_or_else(missing)?;
        let occupied = (0..WIDTH).filter(|&lane| pack.ids[lane] != u32::MAX);
        if occupied.clone().count() == 0 {
            return Err(format!("{word:?} has no triangles"));
        }
        for lane in occupied {
            let bounds = Aabb::of_points(pack.triangle(lane));
            self.leaf(pack.ids[lane], &tree.frame.enclose(&bounds), outer)?;
        }
        Ok(())
    }

    fn leaf(&mut self, id: u32, bounds: &Aabb, outer: &Aabb) -> Result<(), String> {
        if !outer.contains(bounds) {
            return Err(format!("primitive {id} sticks out: {bounds:?} of {outer:?}"));
        }
        if !self.ids.insert(id) {
            return Err(format!("primitive {id} is in two leaves"));
        }
        Ok(())
    }
}
