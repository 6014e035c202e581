#include "server/session/session_origin.h"

#include <cmath>

namespace vantage::session {
namespace {

// By its prior, or by a target that a control network knows, which is within the range of the
// scanner.
std::optional<v1::Vector3> PlaceOf(const v1::Upload& scan) {
  if (scan.has_prior()) return scan.prior().pose().translation();
  for (const v1::TargetSighting& target : scan.targets()) {
    if (target.has_in_world()) return target.in_world();
  }
  return std::nullopt;
}

}  // namespace

std::optional<v1::Vector3> OriginByFirstScan(const v1::Session& session, const v1::Upload& first) {
  if (session.has_origin()) return std::nullopt;
  const std::optional<v1::Vector3> place = PlaceOf(first);
  if (!place.has_value()) return std::nullopt;
  const v1::Vector3& limit = session.model_config().max_half_extent();
  const auto near = [](double coordinate, double half) { return std::abs(coordinate) <= half / 2; };
  if (near(place->x(), limit.x()) && near(place->y(), limit.y()) && near(place->z(), limit.z())) {
    return std::nullopt;
  }
  v1::Vector3 origin;
  origin.set_x(std::round(place->x()));
  origin.set_y(std::round(place->y()));
  origin.set_z(std::round(place->z()));
  return origin;
}

}  // namespace vantage::session
