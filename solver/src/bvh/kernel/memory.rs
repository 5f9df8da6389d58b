//! All that the kernel reads and writes without a check of bounds, in a few wrappers.

use crate::bvh::collapse::Wide;
use crate::bvh::node::{BLOCK, Block, Child, Node, WIDTH};
use crate::bvh::ray::Ray;
use std::arch::x86_64::*;
use std::marker::PhantomData;

/// Bytes of one plane of a node.
pub(super) const PLANE: usize = WIDTH * size_of::<f32>();

/// Nodes and blocks without checks of bounds.
///
/// Every child reference in a [`Wide`] names a node or a block of it (`Wide::check`), so that
/// references that come from it may be followed.
#[derive(Clone, Copy)]
pub(super) struct Tree<'a> {
    nodes: *const Node,
    blocks: *const Block,
    lifetime: PhantomData<&'a Wide>,
}

impl<'a> Tree<'a> {
    pub(super) fn new(wide: &'a Wide) -> Self {
        Self {
            nodes: wide.nodes.as_ptr(),
            blocks: wide.blocks.as_ptr(),
            lifetime: PhantomData,
        }
    }

    /// The node of a reference.
    ///
    /// # Safety
    /// `child` comes from this tree and names a node.
    #[inline]
    pub(super) unsafe fn node(&self, child: Child) -> &'a Node {
        debug_assert!(!child.is_block());
        // SAFETY: the caller's promise, and the check of all references when the tree was built.
        unsafe { &*self.nodes.add(child.index()) }
    }

    /// The block of a reference.
    ///
    /// # Safety
    /// `child` comes from this tree and names a block.
    #[inline]
    pub(super) unsafe fn block(&self, child: Child) -> &'a Block {
        debug_assert!(child.is_block());
        // SAFETY: the caller's promise, and the check of all references when the tree was built.
        unsafe { &*self.blocks.add(child.index()) }
    }

    /// Asks for the cache lines of a node or block. By table, because a branch on what comes next
    /// would be mispredicted half of the time.
    #[inline]
    pub(super) fn prefetch(&self, child: Child) {
        const LINE: usize = 64;
        const { assert!(size_of::<Node>() == size_of::<Block>()) };
        let bases: [*const u8; 2] = [self.nodes.cast(), self.blocks.cast()];
        let kind = usize::from(child.is_block());
        let address = bases[kind].wrapping_add(child.index() * size_of::<Node>());
        for line in 0..size_of::<Node>() / LINE {
            let address = address.wrapping_add(line * LINE).cast();
            // SAFETY: a prefetch has no effect but on the cache and never faults.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(address) };
        }
    }
}

/// Eight lanes of the plane at a byte offset in [`Node::planes`].
///
/// # Safety
/// `offset` is the index of a plane times the size of one.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) unsafe fn planes(node: &Node, offset: usize) -> __m256 {
    debug_assert!(offset.is_multiple_of(PLANE) && offset < size_of_val(&node.planes));
    // SAFETY: the caller's promise; planes are 32 bytes each from the start of a node aligned by 64.
    unsafe { _mm256_load_ps(node.planes.as_ptr().cast::<f32>().byte_add(offset)) }
}

/// The references of a node's children.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn children(node: &Node) -> __m256i {
    // SAFETY: eight references of 32 bits, behind planes of 6 · 32 bytes in a node aligned by 64.
    unsafe { _mm256_load_si256(node.children.as_ptr().cast()) }
}

/// The coordinates of four corners along an axis.
///
/// # Safety
/// `corner` and `axis` are below 3.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) unsafe fn coordinates(block: &Block, corner: usize, axis: usize) -> __m128 {
    debug_assert!(corner < 3 && axis < 3);
    // SAFETY: the caller's promise; rows of 16 bytes in a block aligned by 64.
    unsafe {
        let first = block.corners.as_ptr().cast::<f32>();
        _mm_load_ps(first.add((3 * corner + axis) * BLOCK))
    }
}

/// Reads four lanes.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn load(lanes: &[f32; BLOCK]) -> __m128 {
    // SAFETY: an unaligned load of four floats from an array of four.
    unsafe { _mm_loadu_ps(lanes.as_ptr()) }
}

/// Reads four lanes of f64.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn load_f64(lanes: &[f64; BLOCK]) -> __m256d {
    // SAFETY: an unaligned load of four numbers from an array of four.
    unsafe { _mm256_loadu_pd(lanes.as_ptr()) }
}

/// Writes four lanes.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn store(target: &mut [f32; BLOCK], lanes: __m128) {
    // SAFETY: an unaligned store of four floats into an array of four.
    unsafe { _mm_storeu_ps(target.as_mut_ptr(), lanes) }
}

/// Writes four lanes of f64.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn store_f64(target: &mut [f64; 4], lanes: __m256d) {
    // SAFETY: an unaligned store of four numbers into an array of four.
    unsafe { _mm256_storeu_pd(target.as_mut_ptr(), lanes) }
}

/// Writes four lanes of integers.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn store_u32(target: &mut [u32; 4], lanes: __m128i) {
    // SAFETY: an unaligned store of four numbers into an array of four.
    unsafe { _mm_storeu_si128(target.as_mut_ptr().cast(), lanes) }
}

/// Reads four integers.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn load_axes(axes: &[u32; 4]) -> __m128i {
    // SAFETY: an unaligned load of four numbers from an array of four.
    unsafe { _mm_loadu_si128(axes.as_ptr().cast()) }
}

/// The components of a ray: origin, tmin, direction, tmax.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn load_ray(ray: &Ray) -> __m256 {
    const { assert!(size_of::<Ray>() == size_of::<__m256>()) };
    // SAFETY: an unaligned load of all of a ray, which is eight floats in the order of declaration
    // without padding (`repr(C)`).
    unsafe { _mm256_loadu_ps(std::ptr::from_ref(ray).cast()) }
}

/// Writes eight numbers to the begin of a slice.
///
/// # Panics
/// When the slice is shorter.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn store_eight(target: &mut [u32], lanes: __m256i) {
    let target = &mut target[..WIDTH];
    // SAFETY: an unaligned store of eight numbers into as many.
    unsafe { _mm256_storeu_si256(target.as_mut_ptr().cast(), lanes) }
}

/// Eight lanes as an array.
#[inline]
#[target_feature(enable = "avx2")]
pub(super) fn lanes(v: __m256) -> [f32; WIDTH] {
    let mut lanes = [0.0; WIDTH];
    // SAFETY: an unaligned store of eight floats into an array of eight.
    unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), v) };
    lanes
}

/// The memory of the stacks of `N` rays.
pub(super) struct StackMemory<const N: usize> {
    children: Vec<Child>,
    keys: Vec<i32>,
    capacity: usize,
}

impl<const N: usize> StackMemory<N> {
    /// Stacks for the paths through `wide`. On a path each node leaves at most seven children
    /// behind; one entry lies at the bottom, and eight are read and written at a time.
    pub(super) fn new(wide: &Wide) -> Self {
        let capacity = 1 + (WIDTH - 1) * wide.depth + WIDTH;
        Self {
            children: vec![Child::NOTHING; capacity * N],
            keys: vec![0; capacity * N],
            capacity,
        }
    }

    /// The stacks, each with [`Child::NOTHING`] at the bottom.
    pub(super) fn stacks(&mut self) -> [Stack<'_>; N] {
        let (children, keys) = (self.children.as_mut_ptr(), self.keys.as_mut_ptr());
        std::array::from_fn(|index| Stack {
            children: children.wrapping_add(index * self.capacity),
            keys: keys.wrapping_add(index * self.capacity),
            lifetime: PhantomData,
        })
    }
}

/// What one ray has still to visit: references, and their entry distances as bits with the number
/// of a lane in the lowest three.
#[derive(Clone, Copy)]
pub(super) struct Stack<'a> {
    children: *mut Child,
    keys: *mut i32,
    lifetime: PhantomData<&'a mut [Child]>,
}

impl Stack<'_> {
    /// # Safety
    /// `at` is below the capacity.
    #[inline]
    pub(super) unsafe fn child(&self, at: usize) -> Child {
        // SAFETY: the caller's promise.
        unsafe { *self.children.add(at) }
    }

    /// # Safety
    /// `at` is below the capacity.
    #[inline]
    pub(super) unsafe fn key(&self, at: usize) -> i32 {
        // SAFETY: the caller's promise.
        unsafe { *self.keys.add(at) }
    }

    /// References and keys from `at` on.
    ///
    /// # Safety
    /// `at + 8` is at most the capacity.
    #[inline]
    #[target_feature(enable = "avx2")]
    pub(super) unsafe fn load(&self, at: usize) -> (__m256i, __m256i) {
        // SAFETY: the caller's promise; unaligned loads.
        unsafe {
            (
                _mm256_loadu_si256(self.children.add(at).cast()),
                _mm256_loadu_si256(self.keys.add(at).cast()),
            )
        }
    }

    /// Writes references from `at` on.
    ///
    /// # Safety
    /// `at + 8` is at most the capacity.
    #[inline]
    #[target_feature(enable = "avx2")]
    pub(super) unsafe fn store_children(&self, at: usize, children: __m256i) {
        // SAFETY: the caller's promise; an unaligned store.
        unsafe { _mm256_storeu_si256(self.children.add(at).cast(), children) }
    }

    /// Writes keys from `at` on.
    ///
    /// # Safety
    /// `at + 8` is at most the capacity.
    #[inline]
    #[target_feature(enable = "avx2")]
    pub(super) unsafe fn store_keys(&self, at: usize, keys: __m256i) {
        // SAFETY: the caller's promise; an unaligned store.
        unsafe { _mm256_storeu_si256(self.keys.add(at).cast(), keys) }
    }
}
