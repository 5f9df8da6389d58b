//! Typed indices into the arrays of a [`crate::Scene`].

macro_rules! id {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(pub u32);

        impl $name {
            /// The id of the `index`-th element.
            ///
            /// # Panics
            /// When `index` does not fit 32 bits.
            pub fn new(index: usize) -> Self {
                Self(u32::try_from(index).expect("a scene holds fewer than 2^32 elements of a kind"))
            }

            /// The position in the array that this id belongs to.
            pub fn index(self) -> usize {
                self.0 as usize
            }
        }
    };
}

id!(
    /// Index of a [`crate::Face`] in [`crate::Scene::faces`].
    FaceId
);
id!(
    /// Index of an [`crate::Object`] in [`crate::Scene::objects`].
    ObjectId
);
id!(
    /// Index of a [`crate::Material`] in [`crate::Scene::materials`].
    MaterialId
);
id!(
    /// Index of a [`crate::Texture`] in [`crate::Scene::textures`].
    TextureId
);
