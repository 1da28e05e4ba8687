// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

/// Limits that the validation of options and data shares with the CPU and the CUDA stages. Plain
/// numbers: kernels, algorithms and the API include this header.
namespace gpureg::limits {

/// Lengths outside this range are a mistake of units; the squares of longer ones overflow float.
constexpr float kMinLength = 1e-6f, kMaxLength = 1e6f;
/// Worker threads of a CPU context; more threads than any machine has are a mistake.
constexpr unsigned kMaxThreads = 1024;

/// Points of a cloud, and elements of a batch: numbers stay positive in 32 bits.
constexpr std::uint32_t kMaxPoints = 0x7fffffffu;
/// Floats per feature; bounds the memory of the feature search.
constexpr std::uint32_t kMaxFeatureDimension = 4096;
/// Depth maps of a cloud; a map takes 110 KB.
constexpr std::uint32_t kMaxDepthMaps = 64;
/// Distance of a viewpoint from the cloud, in radii of the normals. Coordinates beyond it have
/// steps of a whole radius in float: rays from there to neighbouring points are the same.
constexpr float kMaxViewpointDistance = 1 << 23;
/// Bits of a cell's coordinate in a key: three of them fit one 64-bit word.
constexpr int kCellBits = 21;
/// Cells on each side of the local origin, along each axis.
constexpr std::int32_t kMaxCells = 1 << (kCellBits - 1);
static_assert(3 * kCellBits < 64, "a key of three coordinates is never kEmptyKey");
/// Largest ratio of the radius of normals, or of wide features, to the feature radius: cells are
/// half a feature radius wide, so larger balls touch thousands of cells.
constexpr float kMaxRadiusRatio = 4.0f;
/// Largest ratio of the feature radius to the voxel size, and of the correspondence distance to it:
/// neighbourhoods beyond them hold so many points that a cloud takes hours.
constexpr float kMaxFeatureRadiusInVoxels = 100.0f, kMaxCorrespondenceInVoxels = 20.0f;
/// Mean points per cell of half a feature radius, from which on features are meaningless.
constexpr double kMaxPointsPerCell = 1000;
/// More points than this with a mean of less than kIsolatedPointsPerCell per cell are isolated: the
/// closest-point grid would take about 20 KB for each.
constexpr std::uint32_t kMaxIsolatedPoints = 20000;
constexpr double kIsolatedPointsPerCell = 1.1;
/// Blocks of a closest-point grid, 4 KB each, and blocks per point of a larger cloud. Surfaces take
/// 0.1 to 0.4 blocks per prepared point, isolated points about 5.4.
constexpr std::uint64_t kMaxClosestBlocks = std::uint64_t(1) << 17;
constexpr double kBlocksPerPoint = 0.5;
/// Candidates of a closest-point grid, and of one of its blocks: longer lists mean millions of
/// points within one correspondence distance of each other.
constexpr std::uint64_t kMaxGridCandidates = std::uint64_t(1) << 28;
/// A map of many points may have more: so many per point (about 120 at the default radii), and as
/// many as 32 bits number.
constexpr std::uint64_t kMaxCandidatesPerPoint = 256, kMaxMapCandidates = std::uint64_t(1) << 32;
/// 24 bits number those of a block, with up to seven gaps for each of its 512 lists.
constexpr std::uint64_t kMaxBlockCandidates = (std::uint64_t(1) << 24) - (std::uint64_t(1) << 12);
/// Blocks in the dense table of cell summaries. The table of a wider cloud, one with far stray
/// points, costs more memory than it saves time.
constexpr std::uint64_t kMaxSummaryBlocks = std::uint64_t(1) << 22;
/// Cells of the grid of surface sides (32 MB); a cloud with a larger box gets no grid.
constexpr std::uint64_t kMaxSurfaceSideCells = std::uint64_t(1) << 26;

/// Quadruples drawn per pair: the GPU keeps one bit for each.
constexpr std::uint32_t kMaxQuadruples = 1u << 30;
/// Quadruples scored per pair.
constexpr std::uint32_t kMaxSurvivors = 1u << 22;
/// Nearest features per point: the search keeps them in registers.
constexpr std::uint32_t kMaxNeighbors = 16;

/// Matches of a pair; four determine a pose and confirm it.
constexpr std::uint32_t kMinMatches = 4, kMaxMatches = 65536;
/// Seeds, and therefore candidate poses, of a pair.
constexpr std::uint32_t kMaxSeeds = 8192;
/// Members of a seed's neighbourhood: a triangle needs three, and the GPU holds all of them in
/// shared memory.
constexpr std::uint32_t kMinMembers = 3, kMaxMembers = 1024;
/// Triangles tried per seed.
constexpr std::uint32_t kMaxTriangles = 4096;
/// Least-squares fits per seed; the consensus set hardly changes after the second.
constexpr std::uint32_t kMaxRefits = 8;

/// Points of a cloud in the coarse score.
constexpr std::uint32_t kMinSample = 64, kMaxSample = 65536;
/// Distinct poses of a pair.
constexpr std::uint32_t kMaxModes = 64;
/// Poses of a pair that the degeneracy search adds.
constexpr std::uint32_t kMaxPerturbedPoses = 8;
/// Iterations of a refinement, which settles long before.
constexpr std::uint32_t kMaxIterations = 1000;

}  // namespace gpureg::limits
