//! What can be wrong with glTF files.

use std::path::PathBuf;
use thiserror::Error;

/// Why a glTF file could not be used. The format has no lines: messages name the element.
#[derive(Debug, Error)]
pub enum GltfError {
    /// The file is not glTF 2.0, or needs an extension that is not supported.
    #[error(
        "{}: not glTF that can be read: {source}; export it again as glTF 2.0 without compression \
         or quantisation extensions",
        file.display()
    )]
    Document {
        /// The file.
        file: PathBuf,
        /// What the parser said.
        source: Box<gltf::Error>,
    },
    /// A buffer that is not there or too short.
    #[error("{}: buffer {index} {problem}; export the file again", file.display())]
    Buffer {
        /// The file.
        file: PathBuf,
        /// The buffer's number.
        index: usize,
        /// What is wrong.
        problem: String,
    },
    /// An image that is not there.
    #[error("{}: image {index} {problem}; export the file again", file.display())]
    Image {
        /// The file.
        file: PathBuf,
        /// The image's number.
        index: usize,
        /// What is wrong.
        problem: &'static str,
    },
    /// An attribute of a mesh that cannot be read.
    #[error(
        "{}: {attribute} of primitive {primitive} of mesh {mesh} {problem}; export the file again",
        file.display()
    )]
    Attribute {
        /// The file.
        file: PathBuf,
        /// The attribute, such as POSITION.
        attribute: &'static str,
        /// The primitive's number in the mesh.
        primitive: usize,
        /// Name or number of the mesh.
        mesh: String,
        /// What is wrong.
        problem: String,
    },
    /// A node that is reached twice, or from itself.
    #[error(
        "{}: {node} has more than one parent or is its own; the nodes must form a tree",
        file.display()
    )]
    Tree {
        /// The file.
        file: PathBuf,
        /// Name or number of the node.
        node: String,
    },
    /// The scene has more vertices or corners than 32-bit indices can name.
    #[error(
        "{}: too large: more than 2^32 vertices or corners in all instances; split the file",
        file.display()
    )]
    TooLarge {
        /// The file.
        file: PathBuf,
    },
    /// A light, camera or transform whose values make no sense.
    #[error("{}: {element}: {problem}", file.display())]
    Value {
        /// The file.
        file: PathBuf,
        /// The node, camera or light.
        element: String,
        /// What is wrong and what it must be.
        problem: &'static str,
    },
}
