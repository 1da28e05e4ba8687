// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <thread>
#include <unordered_map>

#include "surfel_map.hpp"

namespace surfel {
namespace {

/// Runs work(begin, end) on pieces of [0, count).
template <class Work>
void parallel(unsigned threads, std::size_t count, const Work& work) {
  constexpr std::size_t kPiece = 1 << 14;
  const std::size_t pieces = std::clamp<std::size_t>(count / kPiece, 1, threads);
  std::vector<std::thread> pool;
  for (std::size_t k = 1; k < pieces; ++k)
    pool.emplace_back([&, k] { work(count * k / pieces, count * (k + 1) / pieces); });
  work(0, count / pieces);
  for (std::thread& thread : pool) thread.join();
}

class CpuMap : public SurfelMap {
 public:
  CpuMap(const Options& options, unsigned threads)
      : options_(options),
        threads_(threads > 0 ? threads : std::max(1u, std::thread::hardware_concurrency())) {}

  void fuse(const Image& image, const Camera& camera, const Pose& pose, int number,
            int since) override {
    const Frame frame{image.depth, image.colour, image.width, image.height,
                      camera,      pose,         number,      options_.stride};
    const int columns = image.width / options_.stride, rows = image.height / options_.stride;
    const auto cells = static_cast<std::size_t>(columns * rows);
    index(frame, std::max(since, number - options_.active_frames), cells);
    std::vector<std::vector<Surfel>> births(static_cast<std::size_t>(rows));
    const auto by_rows = [&](const auto& work) {
      parallel(threads_, cells, [&](std::size_t begin, std::size_t end) {
        const auto width = static_cast<std::size_t>(columns);
        // Whole rows: a piece has those that begin in it.
        for (std::size_t row = (begin + width - 1) / width; row * width < end; ++row)
          work(static_cast<int>(row));
      });
    };
    fates_.resize(cells);
    // All pixels decide before the first surfel changes.
    by_rows([&](int row) { decide(frame, row, columns); });
    by_rows([&](int row) { apply(frame, row, columns, births[static_cast<std::size_t>(row)]); });
    for (const auto& row : births) surfels_.insert(surfels_.end(), row.begin(), row.end());
    if (++fused_ % kCleanEvery == 0) {
      surfels_.erase(std::remove_if(surfels_.begin(), surfels_.end(),
                                    [&](const Surfel& s) { return !stays(s, number, options_); }),
                     surfels_.end());
    }
  }

  void correct(const std::vector<Correction>& corrections) override {
    if (corrections.empty()) return;
    const Motions motions(corrections);
    parallel(threads_, surfels_.size(), [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k)
        surfel::correct(surfels_[k], motions.frames.data(), motions.sessions.data(),
                        motions.sums.data(), static_cast<int>(motions.frames.size()));
    });
  }

  Cloud download() const override { return surfels_; }
  void upload(const Cloud& surfels) override { surfels_ = surfels; }
  std::size_t size() const override { return surfels_.size(); }

 private:
  void index(const Frame& frame, int since, std::size_t cells) {
    cells_.assign(cells, kNoSurfel);
    for (std::size_t k = 0; k < surfels_.size(); ++k) {
      if (surfels_[k].last < since) continue;
      float z;
      const int cell = cell_of(frame, surfels_[k], z);
      if (cell < 0) continue;
      unsigned long long& key = cells_[static_cast<std::size_t>(cell)];
      key = std::min(key, index_key(z, static_cast<std::uint32_t>(k)));
    }
  }

  void decide(const Frame& frame, int row, int columns) {
    for (int column = 0; column < columns; ++column) {
      Measured m;
      fates_[static_cast<std::size_t>(row * columns + column)] =
          measure(frame, column * frame.stride, row * frame.stride, m)
              ? fate_of(frame, m, cells_.data(), surfels_.data(), column, row)
              : Fate::nothing;
    }
  }

  void apply(const Frame& frame, int row, int columns, std::vector<Surfel>& births) {
    for (int column = 0; column < columns; ++column) {
      const auto cell = static_cast<std::size_t>(row * columns + column);
      const int u = column * frame.stride, v = row * frame.stride;
      Measured m;
      if (fates_[cell] == Fate::nothing || !measure(frame, u, v, m)) continue;
      if (fates_[cell] == Fate::update)
        update(frame, m, u, v, surfels_[static_cast<std::uint32_t>(cells_[cell])]);
      else
        births.push_back(born(frame, m, u, v));
    }
  }

  const Options options_;
  const unsigned threads_;
  std::vector<Surfel> surfels_;
  std::vector<Fate> fates_;
  std::vector<unsigned long long> cells_;
  int fused_ = 0;
};

}  // namespace

Cloud thinned(const Cloud& surfels, std::size_t count) {
  constexpr float kFirstCell = 0.005f, kGrowth = 1.26f;  // metres; half as many cells of a surface
  Cloud result = surfels;
  for (float cell = kFirstCell; result.size() > count; cell *= kGrowth) {
    std::unordered_map<std::uint64_t, std::size_t> place;  // of a cell and side in kept
    Cloud kept;
    for (const Surfel& s : result) {
      std::uint64_t key = 0;
      for (const float x : {s.position.x, s.position.y, s.position.z})
        key = key << 20 | (static_cast<std::uint64_t>(std::llround(x / cell)) & 0xFFFFFu);
      for (const float x : {s.normal.x, s.normal.y, s.normal.z}) key = key << 1 | (x > 0 ? 1u : 0u);
      const auto [found, first] = place.emplace(key, kept.size());
      if (first)
        kept.push_back(s);
      else if (s.confidence > kept[found->second].confidence)
        kept[found->second] = s;
    }
    for (Surfel& s : kept) s.radius = std::max(s.radius, 0.7f * cell);  // no gaps
    result.swap(kept);
  }
  return result;
}

Motions::Motions(const std::vector<Correction>& corrections) : sums(1, MotionSum{}) {
  for (const Correction& c : corrections) {
    frames.push_back(c.frame);
    sessions.push_back(c.session);
    MotionSum sum = sums.back();
    for (int k = 0; k < 9; ++k) sum.m[k] += static_cast<double>(c.motion.r[k]);
    for (int k = 0; k < 3; ++k) sum.m[9 + k] += static_cast<double>(c.motion.t[k]);
    sums.push_back(sum);
  }
}

std::unique_ptr<SurfelMap> make_cpu_map(const Options& options, unsigned threads) {
  return std::make_unique<CpuMap>(options, threads);
}

}  // namespace surfel
