// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <utility>

#include "common/validate.hpp"
#include "files/text_file.hpp"
#include "gpureg/error.hpp"
#include "gpureg/files.hpp"
#include "loop_closure/check.hpp"
#include "loop_closure/commands.hpp"
#include "loop_closure/paths.hpp"
#include "loop_closure/proposals.hpp"
#include "loop_closure/register.hpp"
#include "loop_closure/saved_state.hpp"
#include "loop_closure/verify.hpp"

namespace gpureg::loop_closure {
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

bool same_for_the_host(const Loop& a, const Loop& b) {
  return a.state == b.state && a.target_from_source.matrix() == b.target_from_source.matrix();
}

}  // namespace

/// Two locks. `inbox` guards what every call touches for a moment: the ids, the calls that wait for
/// process(), the published results. `working` is held by process(), save() and load() and guards
/// the state; registrations run under it alone.
struct LoopCloser::Impl {
  using Command = std::function<void(State&)>;

  Impl(const Context& c, const Options& o) : context(c), options(o) { options.validate(); }

  const Context context;
  const Options options;

  mutable std::mutex inbox;
  Registry registry;
  mutable std::vector<Command> commands;
  std::shared_ptr<const std::vector<FragmentPose>> poses =
      std::make_shared<const std::vector<FragmentPose>>();
  std::shared_ptr<const std::vector<Loop>> loops = std::make_shared<const std::vector<Loop>>();

  mutable std::mutex working;
  mutable State state;

  void drain() const {
    std::vector<Command> taken;
    {
      const std::lock_guard<std::mutex> lock(inbox);
      taken.swap(commands);
    }
    for (const Command& command : taken) command(state);
  }

  std::vector<FragmentPose> current_poses() const {
    const Paths graph(state, true, options);
    std::vector<FragmentPose> out;
    int position = 0;
    for (const auto& [id, node] : state.nodes)
      out.push_back({id, node.estimate, graph.id(graph.component(position++))});
    return out;
  }

  void publish() {
    std::vector<Loop> all;
    for (const LoopRecord& record : state.loops) all.push_back(record.loop);
    auto new_loops = std::make_shared<const std::vector<Loop>>(std::move(all));
    auto new_poses = std::make_shared<const std::vector<FragmentPose>>(current_poses());
    const std::lock_guard<std::mutex> lock(inbox);
    loops = std::move(new_loops);
    poses = std::move(new_poses);
  }

  /// One chunk; the queue is as before where it throws.
  std::size_t register_chunk(std::size_t count) {
    const std::vector<Proposal> proposals = next_proposals(state, count);
    const std::vector<RegistrationResult> results =
        register_all(context, state, proposals, options);
    drop_proposals(state, proposals.size());
    for (std::size_t k = 0; k < proposals.size(); ++k)
      add_record(state, record_of(proposals[k].source, proposals[k].target, results[k], options));
    return proposals.size();
  }

  void report(Update& update) {
    for (LoopRecord& record : state.loops) {
      if (record.reported && same_for_the_host(*record.reported, record.loop)) continue;
      record.reported = record.loop;
      update.changed.push_back(record.loop);
    }
    update.proposals_left = state.queue.size();
    publish();
    if (state.poses_changed && options.optimize) update.poses = *poses;
    state.poses_changed = false;
  }
};

LoopCloser::LoopCloser(const Context& context, const Options& options)
    : impl_(std::make_unique<Impl>(context, options)) {}
LoopCloser::~LoopCloser() = default;
LoopCloser::LoopCloser(LoopCloser&&) noexcept = default;
LoopCloser& LoopCloser::operator=(LoopCloser&&) noexcept = default;

void LoopCloser::add(const Fragment& fragment) {
  check_fragment(fragment);
  const std::lock_guard<std::mutex> lock(impl_->inbox);
  impl_->registry.add(fragment.id, fragment.cloud.valid());
  impl_->commands.push_back([fragment, options = &impl_->options](State& state) {
    add_fragment(state, fragment, *options);
  });
}

void LoopCloser::add_odometry(FragmentId source, FragmentId target,
                              const UnalignedIsometry3d& target_from_source,
                              const std::optional<UnalignedMatrix6d>& covariance) {
  check_pose(target_from_source, "target_from_source");
  Odometry edge = modelled_odometry(source, target, target_from_source, impl_->options);
  if (covariance) {
    edge.information = information_of_covariance(*covariance);
    edge.modelled = false;
  }
  const std::lock_guard<std::mutex> lock(impl_->inbox);
  impl_->registry.require_pair(source, target);
  impl_->registry.connect(source, target);
  impl_->commands.push_back([edge](State& state) { loop_closure::add_odometry(state, edge); });
}

void LoopCloser::set_covisible(FragmentId id, const std::vector<FragmentId>& others) {
  const std::lock_guard<std::mutex> lock(impl_->inbox);
  impl_->registry.require_known(id);
  for (const FragmentId other : others) impl_->registry.require_known(other);
  impl_->commands.push_back([id, others](State& state) { add_covisible(state, id, others); });
}

void LoopCloser::propose(FragmentId source, FragmentId target,
                         const std::optional<RegistrationPrior>& prior) {
  if (prior) prior->validate();
  Proposal proposal;
  proposal.source = source;
  proposal.target = target;
  if (prior) proposal.prior = std::make_shared<const RegistrationPrior>(*prior);
  const std::lock_guard<std::mutex> lock(impl_->inbox);
  impl_->registry.require_pair(source, target);
  impl_->registry.require_clouds(source, target);
  impl_->commands.push_back([proposal](State& state) { add_proposal(state, proposal); });
}

void LoopCloser::add_loop(FragmentId source, FragmentId target,
                          const UnalignedIsometry3d& target_from_source,
                          const std::optional<UnalignedMatrix6d>& information, double confidence) {
  check_pose(target_from_source, "target_from_source");
  require(confidence >= 0 && confidence <= 1, "confidence", confidence, "[0, 1]");
  if (information) check_information(*information);
  LoopRecord record =
      host_record(source, target, target_from_source, information, confidence, impl_->options);
  const std::lock_guard<std::mutex> lock(impl_->inbox);
  impl_->registry.require_pair(source, target);
  impl_->commands.push_back([record](State& state) { add_record(state, record); });
}

void LoopCloser::add_result(FragmentId source, FragmentId target,
                            const RegistrationResult& result) {
  check_result(result);
  LoopRecord record = record_of(source, target, result, impl_->options);
  const std::lock_guard<std::mutex> lock(impl_->inbox);
  impl_->registry.require_pair(source, target);
  impl_->commands.push_back([record](State& state) { add_record(state, record); });
}

void LoopCloser::set_poses(const std::vector<FragmentPose>& poses) {
  std::set<FragmentId> seen;
  for (const FragmentPose& pose : poses) {
    check_pose(pose.world_from_fragment,
               "world_from_fragment of fragment " + std::to_string(pose.id));
    if (!seen.insert(pose.id).second)
      throw InvalidArgument("poses name fragment " + std::to_string(pose.id) + " twice");
  }
  const std::lock_guard<std::mutex> lock(impl_->inbox);
  for (const FragmentPose& pose : poses) impl_->registry.require_known(pose.id);
  impl_->commands.push_back([poses](State& state) { set_estimates(state, poses); });
}

void LoopCloser::remove(FragmentId id) {
  const std::lock_guard<std::mutex> lock(impl_->inbox);
  impl_->registry.remove(id);
  impl_->commands.push_back([id](State& state) { remove_fragment(state, id); });
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
    if (!over && !state.queue.empty()) {
      update.registered +=
          impl_->register_chunk(deadline.chunk(impl_->options.chunk, update.registered));
      continue;
    }
    if (!state.graph_changed) break;
    // Loops that are believed now change what overlaps, and what has to be confirmed.
    const Verification verification = verify_loops(state, impl_->options);
    update.status = verification.status;
    update.reason = verification.reason;
    if (over || state.graph_changed) break;
  }
  impl_->report(update);
  return update;
}

std::vector<FragmentPose> LoopCloser::poses() const {
  const std::lock_guard<std::mutex> lock(impl_->inbox);
  return *impl_->poses;
}

std::vector<Loop> LoopCloser::loops() const {
  const std::lock_guard<std::mutex> lock(impl_->inbox);
  return *impl_->loops;
}

std::size_t LoopCloser::size() const {
  const std::lock_guard<std::mutex> lock(impl_->inbox);
  return impl_->registry.size();
}

pose_graph::Graph LoopCloser::graph() const {
  const std::lock_guard<std::mutex> lock(impl_->working);
  return accepted_graph(impl_->state, impl_->options);
}

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
  give_clouds(loaded, clouds, impl_->options);
  const std::lock_guard<std::mutex> lock(impl_->working);
  impl_->state = std::move(loaded);
  {
    const std::lock_guard<std::mutex> inbox_lock(impl_->inbox);
    impl_->commands.clear();
    impl_->registry = Registry(impl_->state);
  }
  impl_->publish();
}

}  // namespace gpureg::loop_closure
