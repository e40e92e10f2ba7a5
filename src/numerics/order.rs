//! Lists in order: by one sort for all of them, since every other type and every other closure is a sort of its own, 5 kB
//! each.

/// Where the numbers stand, the smallest first; of equal ones the first. Not a number is more than all, and less with
/// its sign.
pub fn ascending(keys: &[f64]) -> Vec<usize> {
    let mut order: Vec<(u64, usize)> =
        keys.iter().enumerate().map(|(i, key)| (whole(*key), i)).collect();
    order.sort_unstable();
    order.into_iter().map(|(_, i)| i).collect()
}

/// A whole number with the order of `f64::total_cmp`.
fn whole(x: f64) -> u64 {
    let bits = x.to_bits();
    if bits >> 63 == 1 { !bits } else { bits | 1 << 63 }
}

/// The smallest number first.
pub fn sort(numbers: &mut [f64]) {
    let order = ascending(numbers);
    let sorted: Vec<f64> = order.iter().map(|i| numbers[*i]).collect();
    numbers.copy_from_slice(&sorted);
}

/// What has the smallest key first; of equal ones in the order they are in.
pub fn sort_by<T>(list: &mut [T], key: impl Fn(&T) -> f64) {
    let keys: Vec<f64> = list.iter().map(key).collect();
    let mut order = ascending(&keys);
    swaps(&mut order, |i, j| list.swap(i, j));
}

/// The same of whole numbers and of names: of what can be compared.
pub fn sort_by_key<T, K: Ord>(list: &mut [T], key: impl Fn(&T) -> K) {
    // Lists of names are short.
    for end in 1..list.len() {
        let mut i = end;
        while i > 0 && key(&list[i - 1]) > key(&list[i]) {
            list.swap(i - 1, i);
            i -= 1;
        }
    }
}

/// The largest first; of equal ones in the order they are in.
pub fn sort_down_by<T>(list: &mut [T], key: impl Fn(&T) -> f64) {
    // Backwards and around again, by which equal ones keep their order.
    list.reverse();
    sort_by(list, key);
    list.reverse();
}

/// Swaps that bring what stands at `order[i]` to `i`.
fn swaps(order: &mut [usize], mut swap: impl FnMut(usize, usize)) {
    for i in 0..order.len() {
        let mut from = order[i];
        // What stood there has gone where its place was taken.
        while from < i {
            from = order[from];
        }
        order[i] = from;
        if from != i {
            swap(i, from);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_the_standard_library_has_it() {
        for n in 0..40_usize {
            let list: Vec<(f64, usize)> =
                (0..n).map(|i| (((i * 7919) % 13) as f64 - 6.5, i)).collect();
            let (mut own, mut std) = (list.clone(), list.clone());
            sort_by(&mut own, |x| x.0);
            std.sort_by(|a, b| a.0.total_cmp(&b.0));
            assert_eq!(own, std);
            let (mut own, mut std) = (list.clone(), list.clone());
            sort_down_by(&mut own, |x| x.0);
            std.sort_by(|a, b| b.0.total_cmp(&a.0));
            assert_eq!(own, std);
            let (mut own, mut std) = (list.clone(), list.clone());
            sort_by_key(&mut own, |x| x.1 % 5);
            std.sort_by_key(|x| x.1 % 5);
            assert_eq!(own, std);
        }
    }

    #[test]
    fn every_kind_of_number() {
        let all = [f64::NAN, f64::INFINITY, 1.0, -0.0, 0.0, -1.0, f64::NEG_INFINITY, -f64::NAN];
        let (mut own, mut std) = (all, all);
        sort(&mut own);
        std.sort_by(f64::total_cmp);
        assert_eq!(own.map(f64::to_bits), std.map(f64::to_bits));
    }
}
