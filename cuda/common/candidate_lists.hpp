// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "cuda/common/stage_data.hpp"

/// Candidates of the cells of a closest-point grid on the device. A point is a candidate of about
/// 80 cells, but near only about seven blocks, so a block has one near list: its candidates with
/// coordinates and packed normals, ascending by index. The list of a cell holds positions in it, of
/// one byte where the near list has at most 256 points. The word of a cell has the number of its
/// candidates in the low byte. The other three hold the positions themselves where they fit,
/// otherwise the first position of the list among those of the block. A list of kLongList or more
/// begins with its number of candidates, an aligned word.
namespace gpureg::cuda {

constexpr std::uint32_t kLongList = 255;
/// The lists of a block begin at a multiple of so many bytes.
constexpr std::uint32_t kListUnit = 8;

/// Size of a position in a near list, as a power of two of bytes.
GPUREG_HD std::uint32_t position_size(std::uint32_t near_points) {
  return near_points <= 256 ? 0 : near_points <= 65536 ? 1 : 2;
}
/// True where the word of a cell holds the positions of all its candidates.
GPUREG_HD bool fits_word(std::uint32_t count, std::uint32_t size) {
  return count << (3 + size) <= 24;
}
/// Positions before those of a long list: its word, and those left out before it to align it.
GPUREG_HD std::uint32_t positions_per_word(std::uint32_t size) { return 4u >> size; }
GPUREG_HD std::uint32_t aligned_position(std::uint32_t position, std::uint32_t size) {
  return (position + positions_per_word(size) - 1) & ~(positions_per_word(size) - 1);
}
/// Positions that the list of a cell takes outside its word.
GPUREG_HD std::uint32_t list_room(std::uint32_t count, std::uint32_t size) {
  if (fits_word(count, size)) return 0;
  return count < kLongList ? count : count + 2 * positions_per_word(size) - 1;
}

/// Lists of the block of a brick.
struct BlockLists {
  const std::uint32_t* words;  ///< of the lists of its cells
  std::uint32_t near;          ///< where its near list begins
  std::uint32_t size;          ///< position_size()
};

constexpr std::uint32_t kListBit = 0x80000000u;

/// The two numbers have 31 bits each; the size is in the two bits above.
GPUREG_HD uint2 pack_block_lists(std::uint32_t near, std::uint32_t unit, std::uint32_t size) {
  return {near | (size & 1u ? kListBit : 0u), unit | (size & 2u ? kListBit : 0u)};
}

}  // namespace gpureg::cuda
