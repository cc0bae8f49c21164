//! The same work on many items, on all cores, with results in order.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Does `work` on every item, several at once. The results come in the order of
/// the items; after a failure no further item is begun, and the first failure in
/// that order is the one returned.
pub(crate) fn try_map<T: Sync, R: Send, E: Send>(
    items: &[T],
    work: impl Fn(&T) -> Result<R, E> + Sync,
) -> Result<Vec<R>, E> {
    let next = AtomicUsize::new(0);
    let results: Vec<Mutex<Option<Result<R, E>>>> = items.iter().map(|_| Mutex::new(None)).collect();
    let take = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else { return };
            let result = work(item);
            if result.is_err() {
                next.store(items.len(), Ordering::Relaxed);
            }
            *results[index].lock().expect("no one panics with the lock") = Some(result);
        }
    };
    let workers = thread::available_parallelism().map_or(1, |cores| cores.get()).min(items.len().max(1));
    thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(take);
        }
    });
    results
        .into_iter()
        .filter_map(|result| result.into_inner().expect("no one panics with the lock"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::try_map;

    #[test]
    fn results_keep_the_order_and_failures_are_reported() {
        let items: Vec<u32> = (0..200).collect();
        let doubled: Result<Vec<u32>, String> = try_map(&items, |item| Ok(item * 2));
        assert_eq!(doubled.unwrap(), items.iter().map(|item| item * 2).collect::<Vec<_>>());
        let failed = try_map(&items, |item| if item % 50 == 49 { Err(*item) } else { Ok(()) });
        assert_eq!(failed.unwrap_err() % 50, 49);
        assert_eq!(try_map(&[], |_: &u32| Ok::<(), ()>(())), Ok(Vec::new()));
    }
}
