// SPDX-License-Identifier: BSD-3-Clause
#include "api/confidence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "api/confidence_model.hpp"

namespace gpureg {
namespace {

double at_least(double value, double least) { return std::log(std::max(value, least)); }

void add_free_space(const PoseEvidence& e, std::vector<double>& out) {
  // Where only one cloud's viewpoints are known, what they saw stands for both.
  const bool source = e.source_seen > 0, target = e.target_seen > 0;
  const auto both = [&](double s, double t) {
    return std::pair<double, double>(source ? s : t, target ? t : s);
  };
  const auto seen = both(e.source_seen, e.target_seen),
             impossible = both(e.source_impossible, e.target_impossible);
  const auto hidden = both(e.source_hidden, e.target_hidden);
  const double of_all[2] = {seen.first * impossible.first, seen.second * impossible.second};
  const double most = std::max(impossible.first, impossible.second),
               least = std::min(impossible.first, impossible.second);
  for (const double v : {std::min(seen.first, seen.second), std::max(seen.first, seen.second),
                         std::max(of_all[0], of_all[1]), std::min(of_all[0], of_all[1]), most,
                         least, at_least(most, 3e-3), std::min(hidden.first, hidden.second),
                         at_least(of_all[0] + of_all[1], 1e-3)})
    out.push_back(v);
}

/// Real rooms are full of things that one cloud saw and the other did not look at: where free space
/// is known, up to that sum of both clouds' shares in front of surfaces speaks of which of a pair's
/// poses is the better one, and only through that of whether it is right.
constexpr double kLeastFront = 1e-3, kLeastJudgedFront = 2e-2;

enum class Question { which_is_best, is_it_right };

void add_fronts(const PoseEvidence& e, bool free_space, Question question,
                std::vector<double>& out) {
  const auto share = [](double part, double whole) { return part / std::max(whole, 1e-6); };
  // Of what touches, how much does so from the same side.
  const double source_alike = share(e.source_overlap, e.source_reach),
               target_alike = share(e.target_overlap, e.target_reach);
  const double least =
      free_space && question == Question::is_it_right ? kLeastJudgedFront : kLeastFront;
  for (const double v :
       {at_least(e.source_near_front + e.target_near_front, least),
        std::min(source_alike, target_alike), std::max(source_alike, target_alike),
        std::max(e.source_around, e.target_around), std::min(e.source_around, e.target_around)})
    out.push_back(v);
  if (free_space) return;  // which says the rest
  out.push_back(at_least(e.source_far_front + e.target_far_front, kLeastFront));
  const auto beside = [&](double part, double reach) { return share(part, part + reach); };
  const double source_front = beside(e.source_near_front + e.source_far_front, e.source_reach);
  const double target_front = beside(e.target_near_front + e.target_far_front, e.target_reach);
  const double source_back = beside(e.source_at_back, e.source_reach),
               target_back = beside(e.target_at_back, e.target_reach);
  for (const double v : {std::max(source_front, target_front), std::min(source_front, target_front),
                         at_least(e.source_at_back + e.target_at_back, 1e-3),
                         std::max(source_back, target_back), std::min(source_back, target_back)})
    out.push_back(v);
}

/// What the model sees of one mode; bench/accuracy/fit_confidence.py computes the same.
std::vector<double> measures(const PoseEvidence& e, bool free_space, bool fronts,
                             Question question) {
  const double low = std::min(e.source_overlap, e.target_overlap);
  const double low_balanced = std::min(e.source_balanced_overlap, e.target_balanced_overlap);
  const double high_balanced = std::max(e.source_balanced_overlap, e.target_balanced_overlap);
  double volume = 0;
  for (const double s : e.stiffness) volume += std::log1p(s);
  std::vector<double> out{at_least(e.match_support, 1e-5),
                          at_least(e.match_inliers, 1),
                          at_least(low_balanced, 1e-3),
                          at_least(high_balanced, 1e-3),
                          at_least(low, 1e-3),
                          at_least(e.stiffness[0], 1e-2),
                          at_least(e.stiffness[1], 1e-2),
                          volume};
  if (free_space) add_free_space(e, out);
  if (fronts) add_fronts(e, free_space, question, out);
  return out;
}

double logit(const confidence_model::Regression& regression, const std::vector<double>& x) {
  double sum = regression.bias;
  for (std::size_t k = 0; k < x.size(); ++k) sum += regression.weights[k] * x[k];
  return sum;
}

/// What is known of both clouds, and the regressions for that.
struct Knowledge {
  bool free_space, fronts;
  const confidence_model::Model& model;
};

Knowledge known_of(const std::vector<PoseEvidence>& all) {
  static constexpr confidence_model::Model kModels[2][2] = {
      {confidence_model::neither, confidence_model::fronts},
      {confidence_model::free_space, confidence_model::everything}};
  // What no mode touches tells nothing of what the clouds have.
  bool free_space = false, fronts = false;
  for (const PoseEvidence& e : all) {
    free_space |= e.source_seen > 0 || e.target_seen > 0;
    fronts |= e.source_around > 0 && e.target_around > 0;
  }
  return {free_space, fronts, kModels[free_space][fronts]};
}

/// Of distinct poses at most one is right: what a pose may have beside the others, were each of
/// them judged by itself. Twins share.
std::vector<double> shares(const std::vector<double>& logits) {
  const double most = *std::max_element(logits.begin(), logits.end());
  double sum = 0;
  std::vector<double> out;
  for (const double l : logits) {
    out.push_back(std::exp(l - most));
    sum += out.back();
  }
  for (double& share : out) share /= sum;
  return out;
}

/// The regressions know clouds of thousands of points, and what small shares of those are worth. Of
/// small clouds (rooms in voxels of 10 cm to 1 m: bench/accuracy/few_points.py) poses under which
/// at least 200 points touch are right as often as they say, with 100 three times in four of that,
/// with 20 hardly ever: so few touch under some pose of any two clouds.
double with_so_few_points(Touching touching) {
  constexpr double kFew = 80, kSmallCloud = 1500;
  const double n = touching.count / kFew * std::max(1.0, touching.of / kSmallCloud);
  return 1.0 - std::exp(-n * n);
}

double probability(double logit_value) { return 1.0 / (1.0 + std::exp(-logit_value)); }

}  // namespace

Likeliest likeliest_of(const std::vector<PoseEvidence>& evidence) {
  const Knowledge known = known_of(evidence);
  std::vector<double> value;
  for (const PoseEvidence& e : evidence)
    value.push_back(logit(known.model.ranking,
                          measures(e, known.free_space, known.fronts, Question::which_is_best)));
  const auto most = std::max_element(value.begin(), value.end());
  return {static_cast<std::size_t>(most - value.begin()), *most};
}

void set_confidences(
    std::vector<RegistrationMode>& modes, std::uint32_t refined,
    const std::function<Touching(const RegistrationMode&)>& touching,
    const std::function<bool(const RegistrationMode&, const RegistrationMode&)>& same) {
  if (modes.empty()) return;
  std::vector<PoseEvidence> evidence;
  for (const RegistrationMode& mode : modes) evidence.push_back(mode.evidence);
  const Knowledge known = known_of(evidence);
  const auto seen = [&](const RegistrationMode& mode, Question question) {
    return measures(mode.evidence, known.free_space, known.fronts, question);
  };
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t k = 0; k < modes.size(); ++k)
    order.emplace_back(logit(known.model.ranking, seen(modes[k], Question::which_is_best)), k);
  std::stable_sort(order.begin(), order.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<RegistrationMode> out;
  std::vector<double> own, rank;
  for (const auto& [value, k] : order) {
    const RegistrationMode& mode = modes[k];
    if (std::any_of(out.begin(), out.end(),
                    [&](const RegistrationMode& better) { return same(better, mode); }))
      continue;
    out.push_back(mode);
    own.push_back(value);
    rank.push_back(std::clamp(value, -14.0, 14.0));
  }
  const std::vector<double> share = shares(own);
  const double apart = static_cast<double>(out.size()) / refined;
  for (std::size_t k = 0; k < out.size(); ++k) {
    RegistrationMode& mode = out[k];
    const double rival = k > 0 ? rank[0] : out.size() > 1 ? rank[1] : -14.0;
    std::vector<double> x = seen(mode, Question::is_it_right);
    x.push_back(rank[k]);
    x.push_back(rank[k] - rival);
    x.push_back(apart);
    mode.confidence = probability(logit(known.model.confidence, x));
    mode.overlap_confidence = probability(logit(known.model.overlap, x));
    mode.confidence = std::min(mode.confidence, share[k]) * with_so_few_points(touching(mode));
    if (k > 0) mode.confidence = std::min(mode.confidence, out.front().confidence);
    mode.overlap_confidence = std::min(mode.overlap_confidence, mode.confidence);
  }
  modes = std::move(out);
}

}  // namespace gpureg
