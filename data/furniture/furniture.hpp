// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include "data/mesh.hpp"
#include "data/random.hpp"
#include "data/rooms/house.hpp"

namespace gpureg::synthetic {

/// A piece of furniture in its own frame: x in [-width/2, width/2], y from 0 (its back, at the
/// wall) to depth, z from 0 up. Metres.
struct Piece {
  float width = 0, depth = 0, height = 0;
  std::function<void(MeshBuilder&, Random&)> build;
};

/// The footprint of a piece in the world; exact for quarter turns, its bounding rectangle
/// otherwise.
Rect footprint(const Eigen::Affine3f& world_from_piece, const Piece& piece);
/// Builds a piece, whose details follow from the model, into the house, as an obstacle too.
void build_piece(House& house, const Eigen::Affine3f& world_from_piece, const Piece& piece,
                 std::uint64_t model);
/// The same, wherever the rearrangement of the house leaves it.
void place_piece(House& house, const Eigen::Affine3f& world_from_piece, const Piece& piece,
                 std::uint64_t model);

// rearrange.cpp
/// Where the next piece of the house stands: at its place, elsewhere, at both, or nowhere.
std::vector<Eigen::Affine3f> places_of(House& house, const Eigen::Affine3f& frame,
                                       const Piece& piece);
/// Boxes of 10 to 30 cm on the floors of a house that is rearranged.
void add_boxes(House& house);

// Colours that a house has.
Material wood(Random& random);
Material fabric(Random& random);
Material paint(Random& random);
Material metal(Random& random);

// seating.cpp
Piece chair(Random& random);
Piece office_chair(Random& random);
Piece sofa(Random& random);
Piece armchair(Random& random);
Piece bed(Random& random);

// tables.cpp
Piece dining_table(Random& random);
Piece round_table(Random& random);
Piece coffee_table(Random& random);
Piece desk(Random& random);
Piece piano(Random& random);

// storage.cpp
Piece bookshelf(Random& random);
Piece wardrobe(Random& random);
Piece sideboard(Random& random);
Piece kitchen_counter(Random& random);
Piece fridge(Random& random);

// small_things.cpp
Piece floor_lamp(Random& random);
Piece plant(Random& random);
Piece bicycle(Random& random);
Piece drying_rack(Random& random);
Piece clutter_heap(Random& random);
/// One small thing (book pile, vase, box, ball, bowl, mug, lamp ...) that stands at a point and
/// fits into a circle of this radius.
void small_thing(MeshBuilder& mesh, Random& random, const Eigen::Vector3f& at, float radius);
/// At most count small things spread over a surface.
void litter(MeshBuilder& mesh, Random& random, const Eigen::Vector3f& low,
            const Eigen::Vector3f& high, int count);
/// Books (and gaps) from left to right on a board.
void book_row(MeshBuilder& mesh, Random& random, float left, float right, float back, float depth,
              float bottom, float max_height);

// wall_things.cpp: x along the wall, y away from it, z above the floor; origin on the wall's foot.
void picture(MeshBuilder& mesh, Random& random, float x, float z, float width, float height);
void radiator(MeshBuilder& mesh, Random& random, float x, float width);
void curtain(MeshBuilder& mesh, Random& random, float x, float width, float top);
void wall_shelf(MeshBuilder& mesh, Random& random, float x, float z, float width);
void coat_rack(MeshBuilder& mesh, Random& random, float x);

}  // namespace gpureg::synthetic
