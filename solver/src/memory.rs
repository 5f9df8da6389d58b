//! Sizes in memory. Each structure tells its own (`bytes`) and what it will take (`bytes_for`); what adds up
//! while a task runs stands beside the task.
//!
//! What is counted are the elements of arrays. The allocator's own, stacks, code and the batches of rays that
//! threads work on are not: they do not grow with the task.

/// Memory that an array holds, in bytes.
pub(crate) fn held<T>(values: &Vec<T>) -> usize {
    values.capacity() * size_of::<T>()
}
