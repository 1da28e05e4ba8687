// SPDX-License-Identifier: BSD-3-Clause
#include "records/locate_json.hpp"

#include "json/json.hpp"
#include "records/result_json.hpp"

namespace gpureg::cli {

Json to_json(const localization::LocateResult& result, const std::string& file) {
  Json json{{"file", file},
            {"status", localization::to_string(result.status)},
            {"absent_probability", result.absent_probability},
            {"points", result.scan_points},
            {"stage", localization::to_string(result.stage)},
            {"tiles", result.tiles},
            {"neighborhood_points", result.neighborhood_points},
            {"poses", Json::array()}};
  for (const localization::LocatedPose& pose : result.poses)
    json["poses"].push_back(
        {{"map_from_scan", to_json(pose.map_from_scan.matrix())},
         {"confidence", pose.confidence},
         {"alias", pose.alias},
         {"confidence_alone", pose.verification.confidence},
         {"inlier_ratio", pose.verification.inlier_ratio},
         {"inlier_rmse", pose.verification.inlier_rmse},
         {"information_redwood", to_json(pose.verification.source_moments.information_redwood())},
         {"evidence", to_json(pose.verification.evidence)}});
  return json;
}

}  // namespace gpureg::cli
