// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>
#include <cmath>
#include <list>
#include <mutex>
#include <utility>

#include "common/validate.hpp"
#include "files/text_file.hpp"
#include "gpureg/error.hpp"
#include "gpureg/files.hpp"
#include "loop_closure/check.hpp"
#include "loop_closure/commands.hpp"
#include "loop_closure/neighbors.hpp"
#include "loop_closure/options.hpp"
#include "loop_closure/paths.hpp"
#include "loop_closure/proposals.hpp"
#include "loop_closure/register.hpp"
#include "loop_closure/saving/saved_state.hpp"
#include "loop_closure/verify.hpp"

namespace gpureg::loop_closure {

/// What hosts see between two calls of process().
struct Published {
  std::shared_ptr<const std::vector<FragmentPose>> poses =
      std::make_shared<const std::vector<FragmentPose>>();
  std::shared_ptr<const std::vector<Loop>> loops = std::make_shared<const std::vector<Loop>>();
  std::shared_ptr<const pose_graph::Graph> graph = std::make_shared<const pose_graph::Graph>();
};

namespace {

using Clock = std::chrono::steady_clock;

/// When a process() ends.
class Deadline {
 public:
  explicit Deadline(const ProcessLimits& limits) : limits_(limits), start_(Clock::now()) {}
  bool reached(std::size_t registered) const {
    if (limits_.registrations && registered >= *limits_.registrations) return true;
    if (limits_.should_stop && limits_.should_stop()) return true;
    const std::chrono::duration<double, std::milli> spent = Clock::now() - start_;
    return limits_.milliseconds && spent.count() >= *limits_.milliseconds;
  }
  std::size_t chunk(std::size_t most, std::size_t registered) const {
    return limits_.registrations ? std::min(most, *limits_.registrations - registered) : most;
  }

 private:
  const ProcessLimits& limits_;
  Clock::time_point start_;
};

/// The loop as a host sees it. One that no verification has seen yet fits, as far as is known.
Loop shown(const LoopRecord& record) {
  Loop loop = record.loop;
  if (!record.modes.empty() && loop.reason == LoopReason::not_aligned) {
    loop.state = LoopState::candidate;
    loop.reason = LoopReason::unconfirmed;
  }
  return loop;
}

bool same_for_the_host(const Loop& a, const Loop& b) {
  return a.state == b.state && (a.state != LoopState::accepted ||
                                a.target_from_source.matrix() == b.target_from_source.matrix());
}

/// Room for so many more elements.
template <typename T>
void make_room(std::vector<T>& list, std::size_t more) {
  if (list.capacity() - list.size() < more)
    list.reserve(std::max(list.size() + more, 2 * list.size()));
}

Published published(const State& state, const Options& options) {
  std::vector<Loop> loops;
  for (const LoopRecord& record : state.loops) loops.push_back(shown(record));
  const Paths graph(state, true, options);
  std::vector<FragmentPose> poses;
  int position = 0;
  for (const auto& [id, node] : state.nodes)
    poses.push_back({id, node.estimate, graph.id(graph.component(position++))});
  Published out;
  out.loops = std::make_shared<const std::vector<Loop>>(std::move(loops));
  out.poses = std::make_shared<const std::vector<FragmentPose>>(std::move(poses));
  out.graph = std::make_shared<const pose_graph::Graph>(accepted_graph(state, options));
  return out;
}

}  // namespace

/// Every step either takes place or, where it throws, leaves everything as it was: what has not run
/// is kept for the next call.
///
/// Two locks. `inbox` guards what every call touches for a moment: the ids, the calls that wait for
/// process(), the published results. `working` is held by process(), save() and load() and guards
/// the state; registrations run under it alone.
struct LoopCloser::Impl {
  using Command = std::function<void(State&)>;

  Impl(const Context& c, const Options& o) : context(c), options(in_units(o)) {
    state.voxel_size = options.registration.voxel_size;
  }

  const Context context;
  const Options options;

  mutable std::mutex inbox;
  Registry registry;
  mutable std::list<Command> commands;  ///< a list, since splicing cannot fail
  Published published;

  mutable std::mutex working;
  mutable State state;
  Verification unreported;            ///< the last one that no Update has told of
  bool verification_stopped = false;  ///< it threw or was stopped: it goes first next time

  /// Queues a command unless check(registry), which may add to the registry as its last step,
  /// throws.
  template <typename Check>
  void submit(const Check& check, Command command) {
    std::list<Command> entry;
    entry.push_back(std::move(command));
    const std::lock_guard<std::mutex> lock(inbox);
    check(registry);
    commands.splice(commands.end(), entry);
  }

  Published last() const {
    const std::lock_guard<std::mutex> lock(inbox);
    return published;
  }

  void drain() const {
    std::list<Command> taken;
    {
      const std::lock_guard<std::mutex> lock(inbox);
      taken.swap(commands);
    }
    if (taken.empty()) return;
    try {
      on_copy(state, [&](State& next) {
        for (const Command& command : taken) command(next);
        imply_odometry(next, options);
      });
    } catch (...) {
      const std::lock_guard<std::mutex> lock(inbox);
      commands.splice(commands.begin(), taken);
      throw;
    }
  }

  std::size_t register_chunk(std::size_t count) {
    const std::vector<Proposal> proposals = next_proposals(state, count);
    const std::vector<RegistrationResult> results =
        register_all(context, state, proposals, options);
    std::vector<LoopRecord> records;
    for (std::size_t k = 0; k < proposals.size(); ++k)
      records.push_back(record_of(proposals[k].source, proposals[k].target, results[k], options));
    hear_neighbors(context, state, options, records);
    make_room(state.loops, records.size());
    // Nothing throws from here on: there is room, and the pairs of the queue are known.
    drop_proposals(state, proposals.size());
    for (LoopRecord& record : records) add_record(state, std::move(record));
    return proposals.size();
  }

  void verify(const std::function<bool()>& should_stop) {
    verification_stopped = true;
    unreported = verify_loops(state, options, should_stop);
    verification_stopped = unreported.status == pose_graph::Status::cancelled;
  }

  void report(const std::function<bool()>& should_stop, Update& update) {
    std::vector<std::pair<LoopRecord*, Loop>> changed;
    for (LoopRecord& record : state.loops) {
      const Loop loop = shown(record);
      if (record.reported && same_for_the_host(*record.reported, loop)) continue;
      changed.emplace_back(&record, loop);
      if (record.reported && record.reported->state == loop.state) {
        update.changed.push_back(*record.reported);
        update.changed.back().state = LoopState::retracted;
        update.changed.back().reason = LoopReason::replaced;
      }
      update.changed.push_back(loop);
    }
    update.proposals_left = state.queue.size();
    update.status = unreported.status;
    update.reason = unreported.reason;
    Published now = loop_closure::published(state, options);
    if (state.poses_changed && options.optimize) update.poses = *now.poses;
    if (should_stop) should_stop();
    // Nothing throws from here on.
    for (const auto& [record, loop] : changed) record->reported = loop;
    state.poses_changed = false;
    unreported = {};
    const std::lock_guard<std::mutex> lock(inbox);
    published = std::move(now);
  }
};

LoopCloser::LoopCloser(const Context& context, const Options& options)
    : impl_(std::make_unique<Impl>(context, options)) {}
LoopCloser::~LoopCloser() = default;
LoopCloser::LoopCloser(LoopCloser&&) noexcept = default;
LoopCloser& LoopCloser::operator=(LoopCloser&&) noexcept = default;

void LoopCloser::add(const Fragment& fragment) {
  check_fragment(fragment, impl_->options);
  impl_->submit([&](Registry& registry) { registry.add(fragment.id, fragment.cloud.valid()); },
                [fragment, options = &impl_->options](State& state) {
                  add_fragment(state, fragment, *options);
                });
}

void LoopCloser::add_odometry(FragmentId source, FragmentId target,
                              const UnalignedIsometry3d& target_from_source,
                              const std::optional<UnalignedMatrix6d>& covariance) {
  check_pose(target_from_source, "target_from_source");
  const Odometry edge =
      odometry_edge(source, target, target_from_source, covariance, impl_->options);
  impl_->submit(
      [&](Registry& registry) {
        registry.require_pair(source, target);
        registry.connect(source, target);
      },
      [edge](State& state) { loop_closure::add_odometry(state, edge); });
}

void LoopCloser::set_covisible(FragmentId id, const std::vector<FragmentId>& others) {
  impl_->submit(
      [&](const Registry& registry) {
        registry.require_known(id);
        for (const FragmentId other : others) registry.require_known(other);
      },
      [id, others](State& state) { add_covisible(state, id, others); });
}

void LoopCloser::propose(FragmentId source, FragmentId target,
                         const std::optional<RegistrationPrior>& prior) {
  if (prior) prior->validate();
  Proposal proposal;
  proposal.source = source;
  proposal.target = target;
  if (prior) proposal.prior = std::make_shared<const RegistrationPrior>(*prior);
  impl_->submit(
      [&](const Registry& registry) {
        registry.require_pair(source, target);
        registry.require_clouds(source, target);
      },
      [proposal](State& state) { add_proposal(state, proposal); });
}

void LoopCloser::add_loop(FragmentId source, FragmentId target,
                          const UnalignedIsometry3d& target_from_source,
                          const std::optional<UnalignedMatrix6d>& information, double confidence) {
  check_pose(target_from_source, "target_from_source");
  require(confidence >= 0 && confidence <= 1, "confidence", confidence, "[0, 1]");
  const LoopRecord record =
      host_record(source, target, target_from_source, information, confidence, impl_->options);
  impl_->submit([&](const Registry& registry) { registry.require_pair(source, target); },
                [record](State& state) { add_record(state, record); });
}

void LoopCloser::add_result(FragmentId source, FragmentId target,
                            const RegistrationResult& result) {
  check_result(result);
  const LoopRecord record = record_of(source, target, result, impl_->options);
  check_modes(record);
  impl_->submit([&](const Registry& registry) { registry.require_pair(source, target); },
                [record](State& state) { add_record(state, record); });
}

void LoopCloser::set_poses(const std::vector<FragmentPose>& poses) {
  std::set<FragmentId> seen;
  for (const FragmentPose& pose : poses) {
    check_pose(pose.world_from_fragment,
               "world_from_fragment of fragment " + std::to_string(pose.id));
    if (!seen.insert(pose.id).second)
      throw InvalidArgument("poses name fragment " + std::to_string(pose.id) + " twice");
  }
  impl_->submit(
      [&](const Registry& registry) {
        for (const FragmentPose& pose : poses) registry.require_known(pose.id);
      },
      [poses](State& state) { set_estimates(state, poses); });
}

void LoopCloser::remove(FragmentId id) {
  impl_->submit([&](Registry& registry) { registry.remove(id); },
                [id](State& state) { remove_fragment(state, id); });
}

Update LoopCloser::process(double milliseconds) {
  ProcessLimits limits;
  limits.milliseconds = milliseconds;
  return process(limits);
}

Update LoopCloser::process(const ProcessLimits& limits) {
  if (limits.milliseconds)
    require(std::isfinite(*limits.milliseconds) && *limits.milliseconds >= 0, "milliseconds",
            *limits.milliseconds, "a finite number >= 0");
  const Deadline deadline(limits);
  const std::lock_guard<std::mutex> lock(impl_->working);
  State& state = impl_->state;
  impl_->drain();
  Update update;
  for (;;) {
    refresh_proposals(state, impl_->options);
    const bool over = deadline.reached(update.registered);
    if (!over && !state.queue.empty() && !impl_->verification_stopped) {
      update.registered +=
          impl_->register_chunk(deadline.chunk(impl_->options.chunk, update.registered));
      continue;
    }
    if (!state.graph_changed) break;
    // Loops that are believed now change what overlaps, and what has to be confirmed.
    impl_->verify(limits.should_stop);
    if (over || state.graph_changed) break;
  }
  impl_->report(limits.should_stop, update);
  return update;
}

std::vector<FragmentPose> LoopCloser::poses() const { return *impl_->last().poses; }

std::vector<Loop> LoopCloser::loops() const { return *impl_->last().loops; }

std::size_t LoopCloser::size() const {
  const std::lock_guard<std::mutex> lock(impl_->inbox);
  return impl_->registry.size();
}

pose_graph::Graph LoopCloser::graph() const { return *impl_->last().graph; }

void LoopCloser::save(const std::string& path) const {
  std::string content;
  {
    const std::lock_guard<std::mutex> lock(impl_->working);
    impl_->drain();
    content = to_bytes(impl_->state);
  }
  files::write_atomically(path, content);
}

void LoopCloser::load(const std::string& path, const CloudProvider& clouds) {
  State loaded = from_bytes(files::read_file(path), path);
  check_voxel_size(loaded, impl_->options, path);
  give_clouds(loaded, clouds, impl_->options);
  Registry registry(loaded);
  Published now = published(loaded, impl_->options);
  // Nothing throws from here on.
  const std::lock_guard<std::mutex> lock(impl_->working);
  impl_->state = std::move(loaded);
  impl_->unreported = {};
  impl_->verification_stopped = false;
  const std::lock_guard<std::mutex> inbox_lock(impl_->inbox);
  impl_->commands.clear();
  impl_->registry = std::move(registry);
  impl_->published = std::move(now);
}

}  // namespace gpureg::loop_closure
