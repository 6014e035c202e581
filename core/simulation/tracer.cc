#include "core/simulation/tracer.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace vantage::simulation {
namespace {

// From the real-time collision detection literature: the region of the triangle decides.
Eigen::Vector3f NearestOnTriangle(const Eigen::Vector3f& p, const Eigen::Vector3f& a,
                                  const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  const Eigen::Vector3f ab = b - a;
  const Eigen::Vector3f ac = c - a;
  const Eigen::Vector3f ap = p - a;
  const float d1 = ab.dot(ap);
  const float d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Eigen::Vector3f bp = p - b;
  const float d3 = ab.dot(bp);
  const float d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
  const Eigen::Vector3f cp = p - c;
  const float d5 = ab.dot(cp);
  const float d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  }
  const float sum = va + vb + vc;
  if (!(sum > 0)) return a;  // no area
  return a + ab * (vb / sum) + ac * (vc / sum);
}

// A convex polygon cut to the half space sign * z <= limit.
void Cut(double sign, double limit, std::vector<Eigen::Vector3d>& polygon) {
  std::vector<Eigen::Vector3d> kept;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector3d& a = polygon[i];
    const Eigen::Vector3d& b = polygon[(i + 1) % polygon.size()];
    const double da = limit - sign * a.z();
    const double db = limit - sign * b.z();
    if (da >= 0) kept.push_back(a);
    if ((da > 0 && db < 0) || (da < 0 && db > 0)) kept.push_back(a + (b - a) * (da / (da - db)));
  }
  polygon = std::move(kept);
}

// Distance in plan from a point to a convex polygon, 0 inside.
double DistanceInPlan(const Eigen::Vector2d& p, const std::vector<Eigen::Vector3d>& polygon) {
  double nearest = std::numeric_limits<double>::infinity();
  bool left = true;
  bool right = true;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector2d a = polygon[i].head<2>();
    const Eigen::Vector2d ab = polygon[(i + 1) % polygon.size()].head<2>() - a;
    const double length = ab.squaredNorm();
    const double t = length > 0 ? std::clamp((p - a).dot(ab) / length, 0.0, 1.0) : 0.0;
    nearest = std::min(nearest, (p - a - t * ab).norm());
    const double side = ab.x() * (p - a).y() - ab.y() * (p - a).x();
    left = left && side > 0;
    right = right && side < 0;
  }
  return polygon.size() >= 3 && (left || right) ? 0 : nearest;
}

// Where a ray meets the plane of a triangle. Embree's distances and normals are products of
// approximate reciprocals, which differ from one maker's processors to the other's; which triangle
// a ray meets hardly ever does. So a scene's scans are the same everywhere.
void MeetPlane(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
               const std::array<Eigen::Vector3f, 3>& triangle, TraceHit& hit) {
  const Eigen::Vector3d a = triangle[0].cast<double>();
  const Eigen::Vector3d normal =
      (triangle[1].cast<double>() - a).cross(triangle[2].cast<double>() - a);
  const double towards = normal.dot(direction.cast<double>());
  if (towards == 0) return;  // the ray lies in it
  hit.distance = static_cast<float>(normal.dot(a - origin.cast<double>()) / towards);
  const bool turned = normal.dot(hit.normal.cast<double>()) < 0;
  hit.normal = ((turned ? -1.0 : 1.0) / normal.norm() * normal).cast<float>();
}

}  // namespace

struct Tracer::State {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;

  std::array<Eigen::Vector3f, 3> Corners(uint32_t triangle) const {
    const std::array<uint32_t, 3>& t = triangles[triangle];
    return {vertices[t[0]], vertices[t[1]], vertices[t[2]]};
  }
};

Tracer::Tracer(const TriangleMesh& mesh) : state_(std::make_unique<State>()) {
  state_->vertices = mesh.vertices;
  state_->triangles = mesh.triangles;
  // One thread: parallel work is the caller's to place.
  state_->device = rtcNewDevice("threads=1,set_affinity=0");
  state_->scene = rtcNewScene(state_->device);
  rtcSetSceneFlags(state_->scene, RTC_SCENE_FLAG_ROBUST);
  if (!mesh.triangles.empty()) {
    RTCGeometry geometry = rtcNewGeometry(state_->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    // Embree reads 16 bytes at the last vertex: it must own a padded buffer.
    auto* vertices = static_cast<float*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), mesh.vertices.size()));
    auto* triangles = static_cast<uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(uint32_t), mesh.triangles.size()));
    for (size_t i = 0; i < mesh.vertices.size(); ++i) {
      for (int k = 0; k < 3; ++k) vertices[3 * i + static_cast<size_t>(k)] = mesh.vertices[i][k];
    }
    for (size_t i = 0; i < mesh.triangles.size(); ++i) {
      for (size_t k = 0; k < 3; ++k) triangles[3 * i + k] = mesh.triangles[i][k];
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(state_->scene, geometry);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(state_->scene);
}

Tracer::~Tracer() {
  rtcReleaseScene(state_->scene);
  rtcReleaseDevice(state_->device);
}

void Tracer::TracePacket(const Eigen::Vector3f& origin, std::span<const Eigen::Vector3f> directions,
                         std::span<TraceHit> hits) const {
  alignas(32) std::array<int, kPacket> valid{};
  RTCRayHit8 packet{};
  for (size_t i = 0; i < kPacket; ++i) {
    valid[i] = i < directions.size() ? -1 : 0;
    Eigen::Vector3f d = Eigen::Vector3f::UnitX();
    if (i < directions.size()) d = directions[i];
    packet.ray.org_x[i] = origin.x();
    packet.ray.org_y[i] = origin.y();
    packet.ray.org_z[i] = origin.z();
    packet.ray.dir_x[i] = d.x();
    packet.ray.dir_y[i] = d.y();
    packet.ray.dir_z[i] = d.z();
    packet.ray.tnear[i] = 0;
    packet.ray.tfar[i] = std::numeric_limits<float>::infinity();
    packet.ray.mask[i] = 0xFFFFFFFFu;
    packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect8(valid.data(), state_->scene, &context, &packet);
  for (size_t i = 0; i < directions.size(); ++i) {
    hits[i].hit = packet.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
    if (!hits[i].hit) continue;
    hits[i].distance = packet.ray.tfar[i];
    hits[i].normal =
        Eigen::Vector3f(packet.hit.Ng_x[i], packet.hit.Ng_y[i], packet.hit.Ng_z[i]).normalized();
    hits[i].triangle = packet.hit.primID[i];
    MeetPlane(origin, directions[i], state_->Corners(hits[i].triangle), hits[i]);
  }
}

TraceHit Tracer::Trace(const Eigen::Vector3f& origin, const Eigen::Vector3f& direction,
                       float near) const {
  RTCRayHit ray{};
  ray.ray.org_x = origin.x();
  ray.ray.org_y = origin.y();
  ray.ray.org_z = origin.z();
  ray.ray.dir_x = direction.x();
  ray.ray.dir_y = direction.y();
  ray.ray.dir_z = direction.z();
  ray.ray.tnear = near;
  ray.ray.tfar = std::numeric_limits<float>::infinity();
  ray.ray.mask = 0xFFFFFFFFu;
  ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  ray.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(state_->scene, &context, &ray);
  TraceHit hit;
  hit.hit = ray.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  if (!hit.hit) return hit;
  hit.distance = ray.ray.tfar;
  hit.normal = Eigen::Vector3f(ray.hit.Ng_x, ray.hit.Ng_y, ray.hit.Ng_z).normalized();
  hit.triangle = ray.hit.primID;
  MeetPlane(origin, direction, state_->Corners(hit.triangle), hit);
  return hit;
}

uint32_t Tracer::VisibleFrom(const Eigen::Vector3f& point, std::span<const Eigen::Vector3f> from,
                             float gap) const {
  alignas(32) std::array<int, kPacket> valid{};
  RTCRay8 packet{};
  for (size_t i = 0; i < kPacket; ++i) {
    Eigen::Vector3f way = Eigen::Vector3f::UnitX();
    if (i < from.size()) way = from[i] - point;
    const float length = way.norm();
    // Nothing can lie between points that are closer than the gaps.
    valid[i] = i < from.size() && length > 2 * gap ? -1 : 0;
    const Eigen::Vector3f d = way / std::max(length, 1e-9f);
    packet.org_x[i] = point.x();
    packet.org_y[i] = point.y();
    packet.org_z[i] = point.z();
    packet.dir_x[i] = d.x();
    packet.dir_y[i] = d.y();
    packet.dir_z[i] = d.z();
    packet.tnear[i] = gap;
    packet.tfar[i] = length - gap;
    packet.mask[i] = 0xFFFFFFFFu;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded8(valid.data(), state_->scene, &context, &packet);
  uint32_t visible = 0;
  for (size_t i = 0; i < from.size(); ++i) {
    if (valid[i] == 0 || packet.tfar[i] >= 0) visible |= 1u << i;
  }
  return visible;
}

double Tracer::Clearance(const Eigen::Vector3d& point, double limit) const {
  struct Search {
    const State* state;
    Eigen::Vector3f point;
    float nearest;
  };
  Search search{state_.get(), point.cast<float>(), static_cast<float>(limit)};
  RTCPointQuery query{};
  query.x = search.point.x();
  query.y = search.point.y();
  query.z = search.point.z();
  query.radius = search.nearest;
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(
      state_->scene, &query, &context,
      [](RTCPointQueryFunctionArguments* arguments) {
        auto& found = *static_cast<Search*>(arguments->userPtr);
        const std::array<uint32_t, 3>& t = found.state->triangles[arguments->primID];
        const Eigen::Vector3f nearest =
            NearestOnTriangle(found.point, found.state->vertices[t[0]], found.state->vertices[t[1]],
                              found.state->vertices[t[2]]);
        const float distance = (nearest - found.point).norm();
        if (distance >= found.nearest) return false;
        found.nearest = distance;
        arguments->query->radius = distance;
        return true;
      },
      &search);
  // The limit itself, not what single precision makes of it.
  return search.nearest < static_cast<float>(limit) ? static_cast<double>(search.nearest) : limit;
}

bool Tracer::CylinderFree(const Eigen::Vector2d& foot, double radius, double low,
                          double high) const {
  struct Search {
    const State* state;
    Eigen::Vector2d foot;
    double radius, low, high;
    bool free = true;
  };
  Search search{state_.get(), foot, radius, low, high};
  RTCPointQuery query{};
  query.x = static_cast<float>(foot.x());
  query.y = static_cast<float>(foot.y());
  query.z = static_cast<float>(0.5 * (low + high));
  query.radius = static_cast<float>(std::hypot(radius, 0.5 * (high - low)) + 1e-4);
  RTCPointQueryContext context;
  rtcInitPointQueryContext(&context);
  rtcPointQuery(
      state_->scene, &query, &context,
      [](RTCPointQueryFunctionArguments* arguments) {
        auto& found = *static_cast<Search*>(arguments->userPtr);
        if (!found.free) return false;
        std::vector<Eigen::Vector3d> polygon;
        for (const uint32_t vertex : found.state->triangles[arguments->primID]) {
          polygon.push_back(found.state->vertices[vertex].cast<double>());
        }
        Cut(1, found.high, polygon);
        Cut(-1, -found.low, polygon);
        if (polygon.empty() || DistanceInPlan(found.foot, polygon) >= found.radius) return false;
        found.free = false;
        arguments->query->radius = 0;
        return true;
      },
      &search);
  return search.free;
}

}  // namespace vantage::simulation
