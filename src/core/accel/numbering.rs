//! Which shape a primitive belongs to, by its number over all shapes.

/// One run of numbers for each shape.
#[derive(Default)]
pub struct Numbering {
    /// Shape and number of its first primitive, ascending in both; runs may be empty.
    runs: Vec<(u32, u32)>,
    /// Numbers share a block if they agree in all bits above these.
    block_bits: u32,
    /// For each block the runs its numbers may lie in begin here; they end where those of the next block begin, inclusive.
    blocks: Vec<u32>,
}

impl Numbering {
    /// From shapes and the number of each one's first primitive, ascending in both, and the count of all.
    pub fn new(runs: Vec<(u32, u32)>, count: u32) -> Self {
        // About two blocks a run: most hold the numbers of one run, which is then found without a search.
        let block_bits = (count / (2 * runs.len().max(1) as u32)).max(1).ilog2();
        let holding = |number: u32| (runs.partition_point(|(_, first)| *first <= number)).saturating_sub(1) as u32;
        let blocks = (0..=(count >> block_bits) + 1).map(|block| holding(block << block_bits)).collect();
        Self { runs, block_bits, blocks }
    }

    /// Shape, and number within the shape.
    #[inline]
    pub fn find(&self, number: u32) -> (u32, u32) {
        let block = (number >> self.block_bits) as usize;
        let [low, high] = [self.blocks[block] as usize, self.blocks[block + 1] as usize];
        let run = low + self.runs[low + 1..=high].partition_point(|(_, first)| *first <= number);
        let (shape, first) = self.runs[run];
        (shape, number - first)
    }

    /// The number of a shape's first primitive; `None` for a shape that is not there.
    pub fn first(&self, shape: u32) -> Option<u32> {
        let run = self.runs.binary_search_by_key(&shape, |(shape, _)| *shape).ok()?;
        Some(self.runs[run].1)
    }

    /// Memory it takes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.runs.as_slice()) + size_of_val(self.blocks.as_slice())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_every_number() {
        let sizes: [&[u32]; 5] =
            [&[1], &[2, 2, 12, 12], &[0, 3, 0, 0, 1, 0], &[1000, 1, 1, 1, 1, 1, 70_000], &[1; 3000]];
        for sizes in sizes {
            let mut runs = Vec::new();
            let mut expected = Vec::new();
            for (i, size) in sizes.iter().enumerate() {
                let shape = 3 * i as u32;
                runs.push((shape, expected.len() as u32));
                expected.extend((0..*size).map(|prim| (shape, prim)));
            }
            let numbering = Numbering::new(runs.clone(), expected.len() as u32);
            for (number, found) in expected.iter().enumerate() {
                assert_eq!(numbering.find(number as u32), *found);
            }
            assert!(runs.iter().all(|(shape, first)| numbering.first(*shape) == Some(*first)));
            assert_eq!(numbering.first(1), None);
        }
    }
}
