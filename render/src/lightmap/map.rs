//! The texels of a lightmap: what they hold and what they stand for.

use super::atlas::Atlas;
use super::luxels::Luxel;
use crate::image::Image;
use luxel_scenes::Rgb;
use luxel_solver::gather::Gathered;

/// What a texel is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Texel {
    /// No face is there; its value is that of the nearest chart.
    Empty,
    /// A face is there, but its points lie under other geometry: its value is that of its neighbours as far as filtering reads
    /// it, and zero beyond.
    Buried,
    /// Light was gathered for it.
    Lit,
}

impl Texel {
    /// The sample that stands for it in pictures of validity.
    pub fn sample(self) -> u8 {
        match self {
            Self::Empty => 0,
            Self::Buried => 128,
            Self::Lit => 255,
        }
    }
}

/// Values of all texels of an atlas, page by page and row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Lightmap {
    /// Width and height of every page in texels.
    pub size: [usize; 2],
    /// Number of pages.
    pub pages: usize,
    /// What each texel is.
    pub texels: Vec<Texel>,
    /// Irradiance in W/m² (lx), zero where nothing is known.
    pub values: Vec<Rgb>,
    /// Standard error of the values, in the same unit.
    pub errors: Vec<Rgb>,
}

impl Lightmap {
    /// A map with what was gathered at luxels, and nothing elsewhere. A texel of several luxels holds their mean.
    ///
    /// # Panics
    /// When there is not one of `gathered` for each luxel.
    pub fn new(atlas: &Atlas, luxels: &[Luxel], buried: &[u32], gathered: &[Gathered]) -> Self {
        assert_eq!(
            luxels.len(),
            gathered.len(),
            "something gathered at each luxel"
        );
        let count = atlas.texels();
        let mut map = Self {
            size: atlas.size,
            pages: atlas.pages,
            texels: vec![Texel::Empty; count],
            values: vec![Rgb::ZERO; count],
            errors: vec![Rgb::ZERO; count],
        };
        for &texel in buried {
            map.texels[texel as usize] = Texel::Buried;
        }
        let mut rest = gathered;
        for own in luxels.chunk_by(|a, b| a.texel == b.texel) {
            let (gathered, after) = rest.split_at(own.len());
            rest = after;
            let share = 1.0 / own.len() as f64;
            let mean =
                |value: fn(&Gathered) -> Rgb| gathered.iter().map(value).sum::<Rgb>() * share;
            // Noise is each luxel's own, the error of the mesh is common to all.
            let noise = mean(|g| g.sampling().0 * g.sampling().0) * share;
            let mesh = mean(|g| g.discretisation.0);
            let texel = own[0].texel as usize;
            map.texels[texel] = Texel::Lit;
            map.values[texel] = mean(|g| g.irradiance().0);
            map.errors[texel] = (noise + mesh * mesh).map(f64::sqrt);
        }
        map
    }

    /// Positions of the texels whose light was gathered.
    pub fn lit(&self) -> impl Iterator<Item = usize> + Clone + '_ {
        let texels = self.texels.iter().enumerate();
        texels
            .filter(|(_, texel)| **texel == Texel::Lit)
            .map(|(position, _)| position)
    }

    /// Texels of a page.
    pub fn page_texels(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// Memory of maps of so many texels, in bytes.
    pub fn bytes_for(texels: usize) -> usize {
        texels * (size_of::<Texel>() + 2 * size_of::<Rgb>())
    }

    /// What each texel of a page is, as samples of a grey picture.
    pub fn validity(&self, page: usize) -> Vec<u8> {
        let texels = self.page_texels();
        let own = &self.texels[page * texels..(page + 1) * texels];
        own.iter().map(|texel| texel.sample()).collect()
    }

    /// One of the pages of some values.
    pub fn page(&self, page: usize, values: &[Rgb]) -> Image {
        let texels = self.page_texels();
        let own = &values[page * texels..(page + 1) * texels];
        Image {
            width: self.size[0],
            height: self.size[1],
            pixels: own.iter().map(|value| value.as_vec3().to_array()).collect(),
        }
    }
}
