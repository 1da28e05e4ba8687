// SPDX-License-Identifier: BSD-3-Clause
#include "api/pair_input.hpp"

#include "common/shown.hpp"

namespace gpureg {

void check_features(const PreparedState& source, const PreparedState& target) {
  if (source.feature_dimension != target.feature_dimension)
    throw InvalidArgument("feature_dimension differs: source has " +
                          std::to_string(source.feature_dimension) + ", target has " +
                          std::to_string(target.feature_dimension));
}

const PreparedState* checked_state(const Context& context, const PreparedCloud& cloud,
                                   const RegistrationSettings& options, const std::string& name) {
  if (!cloud.valid())
    throw InvalidArgument(name + " is an empty handle: it was not made by prepare()");
  const PreparedState& state = *Access::state(cloud);
  if (state.owner != Access::engine(context)->memory())
    throw InvalidArgument(name + " was prepared by a context of another backend or device than " +
                          context.description());
  const float needed = options.prepare.max_correspondence_distance;
  if (needed > state.options.max_correspondence_distance)
    throw InvalidArgument(name + " was prepared with max_correspondence_distance " +
                          shown(state.options.max_correspondence_distance) + ", less than " +
                          shown(needed) + " asked for now");
  return &state;
}

void check_pairs(const Context& context, const std::vector<PreparedCloud>& clouds,
                 const std::vector<Pair>& pairs, const RegistrationSettings& options) {
  std::vector<std::uint8_t> used(clouds.size(), 0);
  for (std::size_t p = 0; p < pairs.size(); ++p) {
    for (const std::uint32_t k : {pairs[p].source, pairs[p].target}) {
      if (k >= clouds.size())
        throw InvalidArgument("pairs[" + std::to_string(p) + "] names cloud " + std::to_string(k) +
                              ", but there are " + std::to_string(clouds.size()));
      if (!used[k]) checked_state(context, clouds[k], options, "clouds[" + std::to_string(k) + "]");
      used[k] = 1;
    }
  }
}

}  // namespace gpureg
