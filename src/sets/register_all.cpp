// SPDX-License-Identifier: BSD-3-Clause
#include "gpureg/sets/register_all.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "common/host_threads.hpp"

namespace gpureg {
namespace {

/// Pairs that a context takes at a time.
constexpr std::size_t kChunk = 256;
constexpr std::chrono::milliseconds kPeriod{100};

/// The pairs that a journal lacks.
std::vector<std::size_t> left_in(const PairJournal& journal,
                                 const std::vector<std::size_t>& order) {
  std::vector<std::size_t> left;
  for (const std::size_t k : order)
    if (!journal.done(k)) left.push_back(k);
  return left;
}

/// What the threads of a run share.
struct Run {
  PairJournal& journal;
  std::vector<std::size_t> left;  // in the order of work
  std::mutex mutex;               // of all that follows
  std::condition_variable changed;
  std::size_t next = 0, ended = 0;
  std::vector<std::size_t> prepared;  // by each thread
  RegisterAllReport report{};
  std::exception_ptr failed = nullptr;
  std::atomic<bool> stop{false};

  /// Pairs of the next chunk; empty: none is left.
  std::vector<std::size_t> take_chunk() {
    const std::lock_guard lock(mutex);
    const std::size_t begin = next;
    next = std::min(left.size(), next + kChunk);
    return {left.begin() + static_cast<std::ptrdiff_t>(begin),
            left.begin() + static_cast<std::ptrdiff_t>(next)};
  }

  void work(std::size_t thread, const Context& context, const FragmentSet& fragments,
            const RegistrationOptions& options, std::size_t memory) {
    try {
      FragmentAligner aligner(context, fragments, options, memory);
      for (std::vector<std::size_t> chunk; !stop && !(chunk = take_chunk()).empty();) {
        std::vector<Pair> pairs;
        for (const std::size_t k : chunk) pairs.push_back(journal.pairs()[k]);
        const auto take = [&](std::size_t k, const RegistrationResult& result) {
          const std::lock_guard lock(mutex);
          journal.add(chunk[k], result);
        };
        aligner.align(pairs, take, [&] {
          const std::lock_guard lock(mutex);
          journal.flush();
          prepared[thread] = aligner.prepared();
          return stop.load();
        });
        const std::lock_guard lock(mutex);
        journal.flush();
        prepared[thread] = aligner.prepared();
      }
      const std::lock_guard lock(mutex);
      report.unusable.insert(aligner.unusable().begin(), aligner.unusable().end());
    } catch (...) {
      const std::lock_guard lock(mutex);
      if (!failed) failed = std::current_exception();
      stop = true;
    }
    const std::lock_guard lock(mutex);
    ++ended;
    changed.notify_all();
  }
};

}  // namespace

std::vector<Pair> all_pairs(std::size_t fragments) {
  std::vector<Pair> pairs;
  for (std::uint32_t i = 0; i < fragments; ++i)
    for (std::uint32_t j = i + 1; j < fragments; ++j) pairs.push_back({j, i});
  return pairs;
}

RunIdentity identity_of(const FragmentSet& fragments, const RegistrationOptions& options) {
  RunIdentity run{RunIdentity::settings_of(options), {}};
  for (std::size_t k = 0; k < fragments.size(); ++k)
    run.clouds.push_back({fragments.name(k), fragments.fingerprint(k)});
  return run;
}

void register_all(const Context& context, const std::vector<PreparedCloud>& clouds,
                  PairJournal& journal, const RegistrationOptions& options,
                  const std::optional<GravityPrior>& gravity, const SetCallbacks& callbacks) {
  std::vector<std::size_t> left;
  std::vector<Pair> pairs;
  for (std::size_t k = 0; k < journal.size(); ++k)
    if (!journal.done(k)) {
      left.push_back(k);
      pairs.push_back(journal.pairs()[k]);
    }
  BatchCallbacks batch;
  batch.on_result = [&](std::size_t k, const RegistrationResult& result) {
    journal.add(left[k], result);
    if (callbacks.on_progress) callbacks.on_progress(journal.done());
  };
  batch.should_stop = [&] {
    journal.flush();
    return callbacks.should_stop && callbacks.should_stop();
  };
  std::vector<RegistrationPrior> priors;
  if (gravity) priors.assign(left.size(), RegistrationPrior{gravity});
  align_batch(context, clouds, pairs, options, batch, priors);
  journal.flush();
}

RegisterAllReport register_all(
    const std::vector<Context>& contexts, const FragmentSet& fragments, PairJournal& journal,
    const RegistrationOptions& options, std::size_t memory,
    const std::function<bool(std::size_t done, std::size_t prepared)>& go_on) {
  options.validate();
  Run run{journal, left_in(journal, in_tiles(journal.pairs())), {}, {}, 0, 0, {}};
  run.prepared.resize(contexts.size());
  std::vector<std::thread> threads = start_threads(contexts.size(), [&](std::size_t k) {
    return std::thread([&, k] { run.work(k, contexts[k], fragments, options, memory); });
  });
  // A limit on threads leaves this one.
  if (threads.empty() && !contexts.empty()) run.work(0, contexts[0], fragments, options, memory);
  std::exception_ptr raised = nullptr;
  std::unique_lock lock(run.mutex);
  const auto tell = [&] {
    if (!go_on || raised || run.stop) return;
    std::size_t prepared = 0;
    for (const std::size_t of_thread : run.prepared) prepared += of_thread;
    const std::size_t done = journal.done();
    lock.unlock();
    try {
      if (!go_on(done, prepared)) run.stop = true;
    } catch (...) {
      raised = std::current_exception();
      run.stop = true;
    }
    lock.lock();
  };
  while (run.ended < threads.size()) {
    run.changed.wait_for(lock, kPeriod);
    tell();
  }
  tell();  // the end, however short the run was
  lock.unlock();
  for (std::thread& thread : threads) thread.join();
  if (raised) std::rethrow_exception(raised);
  if (run.failed) std::rethrow_exception(run.failed);
  for (const std::size_t k : run.left) {
    const auto bad = [&](std::uint32_t fragment) {
      return run.report.unusable.count(fragment) > 0;
    };
    const Pair& pair = journal.pairs()[k];
    if (!journal.done(k) && !bad(pair.source) && !bad(pair.target)) run.report.complete = false;
  }
  return std::move(run.report);
}

}  // namespace gpureg
