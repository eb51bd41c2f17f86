//! The largest set of items that pairwise agree: a maximum clique.
//!
//! Branch and bound with a greedy colouring as bound (Tomita and Seki 2003). The problem is NP-hard, so the search
//! has a budget and returns the best clique seen when that is spent; a greedy clique is found at once.

/// Indices of a largest clique, ascending; `agrees[a][b]` must be symmetric.
///
/// Visits at most `num_nodes_max` nodes of the search tree, each of cost quadratic in the number of items.
pub(super) fn largest_clique(agrees: &[Vec<bool>], num_nodes_max: u32) -> Vec<usize> {
    let degree = |item: usize| agrees[item].iter().filter(|&&agrees| agrees).count();
    let mut items: Vec<usize> = (0..agrees.len()).collect();
    items.sort_by_key(|&item| (std::cmp::Reverse(degree(item)), item));
    let mut search = Search { agrees, best: Vec::new(), num_nodes_left: num_nodes_max.max(1) };
    search.expand(&mut Vec::new(), &items);
    search.best.sort_unstable();
    search.best
}

struct Search<'a> {
    agrees: &'a [Vec<bool>],
    best: Vec<usize>,
    num_nodes_left: u32,
}

impl Search<'_> {
    /// Tries to extend `clique` by `candidates`, all of which agree with all of its members.
    fn expand(&mut self, clique: &mut Vec<usize>, candidates: &[usize]) {
        if clique.len() > self.best.len() {
            self.best.clone_from(clique);
        }
        if self.num_nodes_left == 0 {
            return;
        }
        self.num_nodes_left -= 1;
        let colored = self.color(candidates);
        for position in (0..colored.len()).rev() {
            let (item, num_colors) = colored[position];
            if clique.len() + num_colors <= self.best.len() {
                return;
            }
            let remaining: Vec<usize> = colored[..position]
                .iter()
                .map(|&(other, _)| other)
                .filter(|&other| self.agrees[item][other])
                .collect();
            clique.push(item);
            self.expand(clique, &remaining);
            clique.pop();
        }
    }

    /// Sorts the candidates into classes of which no two agree; a clique takes at most one of each. Returns every
    /// candidate with the number of classes up to its own.
    fn color(&self, candidates: &[usize]) -> Vec<(usize, usize)> {
        let mut classes: Vec<Vec<usize>> = Vec::new();
        for &item in candidates {
            let is_free = |class: &&mut Vec<usize>| class.iter().all(|&other| !self.agrees[item][other]);
            match classes.iter_mut().find(is_free) {
                Some(class) => class.push(item),
                None => classes.push(vec![item]),
            }
        }
        let numbered = classes.into_iter().enumerate();
        numbered.flat_map(|(number, class)| class.into_iter().map(move |item| (item, number + 1))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn is_clique(agrees: &[Vec<bool>], set: &[usize]) -> bool {
        set.iter().all(|&a| set.iter().all(|&b| a == b || agrees[a][b]))
    }

    /// Size of the largest clique by trying all subsets.
    fn exhaustive(agrees: &[Vec<bool>]) -> usize {
        let subset = |mask: u32| (0..agrees.len()).filter(|&item| mask >> item & 1 == 1).collect::<Vec<_>>();
        (0..1u32 << agrees.len())
            .map(subset)
            .filter(|set| is_clique(agrees, set))
            .map(|set| set.len())
            .max()
            .unwrap()
    }

    fn random_graph(seed: u64, num_items: usize, density: f64) -> Vec<Vec<bool>> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut agrees = vec![vec![false; num_items]; num_items];
        for a in 0..num_items {
            for b in 0..a {
                let value = rng.random::<f64>() < density;
                agrees[a][b] = value;
                agrees[b][a] = value;
            }
        }
        agrees
    }

    #[test]
    fn agrees_with_trying_all_subsets() {
        for seed in 0..40 {
            let agrees = random_graph(seed, 11, 0.2 + 0.6 * (seed as f64 / 40.0));
            let clique = largest_clique(&agrees, u32::MAX);
            assert!(is_clique(&agrees, &clique));
            assert_eq!(clique.len(), exhaustive(&agrees), "seed {seed}");
        }
    }

    #[test]
    fn a_small_budget_still_gives_a_clique() {
        let agrees = random_graph(7, 120, 0.5);
        let clique = largest_clique(&agrees, 50);
        assert!(is_clique(&agrees, &clique) && clique.len() >= 5, "{clique:?}");
        assert!(largest_clique(&[], 10).is_empty());
    }
}
