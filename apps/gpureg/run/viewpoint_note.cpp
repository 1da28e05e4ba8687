// SPDX-License-Identifier: BSD-3-Clause
#include "run/viewpoint_note.hpp"

#include <iostream>

#include "text.hpp"

namespace gpureg::cli {

void ViewpointNote::see(const PointCloud& cloud, const std::string& file) {
  const double share = cloud.view().share_facing_away();
  if (share <= PointCloudView::kMaxFacingAway) return;
  ++clouds_;
  if (share > most_) {
    most_ = share;
    worst_ = file;
  }
}

void ViewpointNote::print() const {
  if (clouds_ == 0) return;
  std::cerr << "gpureg: note: " << percent(most_) << " % of the normals of " << worst_
            << " show all viewpoints their back"
            << (clouds_ > 1 ? ", and many of " + std::to_string(clouds_ - 1) + " more clouds" : "")
            << ": are the viewpoints in the frame of the cloud, and do the normals point to where "
               "it was seen from?"
            << std::endl;
}

}  // namespace gpureg::cli
