#include "core/registration/disagreements.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

namespace vantage::registration {
namespace {

constexpr size_t kFewestPieces = 3;
// m2, a hand's breadth of a door's edge: what is less is within what edges leave at any pose.
constexpr double kLeastArea = 0.05;

// Surface by how it lies: what is said of it.
enum class Lie : uint8_t { kWall, kFloor, kCeiling };
Lie LieOf(const Eigen::Vector3f& normal) {
  constexpr float kLevel = 0.7f;  // cosine, 45 degrees
  if (normal.z() > kLevel) return Lie::kFloor;
  return normal.z() < -kLevel ? Lie::kCeiling : Lie::kWall;
}

const char* WordsFor(DisagreementKind kind, Lie lie) {
  static constexpr std::array<const char*, 3> kBehind = {
      "sees through a wall", "sees through the floor", "sees through the ceiling"};
  static constexpr std::array<const char*, 3> kNotThere = {
      "does not see a wall that is there", "does not see the floor or a top that is there",
      "does not see the ceiling that is there"};
  switch (kind) {
    case DisagreementKind::kInEmptySpace:
      return "sees something where other scans saw through";
    case DisagreementKind::kBehindSurface:
      return kBehind[static_cast<size_t>(lie)];
    case DisagreementKind::kSeenThrough:
      return kNotThere[static_cast<size_t>(lie)];
  }
  return "";
}

using Cube = std::array<int, 3>;
using Layer = std::map<Cube, std::vector<size_t>>;

Cube CubeOf(const Eigen::Vector3d& at, double edge) {
  const Eigen::Vector3i cube = (at / edge).array().floor().cast<int>();
  return {cube.x(), cube.y(), cube.z()};
}

struct Group {
  std::vector<Cube> cubes;
  std::vector<size_t> pieces;
};

// Takes the cubes that hang together with the first out of the layer.
Group TakeFirstGroup(Layer& layer) {
  std::vector<Cube> open = {layer.begin()->first};
  Group group;
  while (!open.empty()) {
    const Cube at = open.back();
    open.pop_back();
    const auto held = layer.extract(at);
    if (held.empty()) continue;
    group.cubes.push_back(at);
    group.pieces.insert(group.pieces.end(), held.mapped().begin(), held.mapped().end());
    for (int z = -1; z <= 1; ++z) {
      for (int y = -1; y <= 1; ++y) {
        for (int x = -1; x <= 1; ++x) {
          const Cube next = {at[0] + x, at[1] + y, at[2] + z};
          if (layer.contains(next)) open.push_back(next);
        }
      }
    }
  }
  std::sort(group.pieces.begin(), group.pieces.end());
  return group;
}

// A sum over pieces, before the centre is divided by the area.
void AddTo(Disagreement& sum, const Eigen::Vector3d& at, double area) {
  sum.centre += area * at;
  sum.area += area;
  sum.box.extend(at);
}

}  // namespace

std::vector<Disagreement> GroupDisagreements(std::span<const DisagreeingPiece> pieces,
                                             std::span<const UnknownPiece> unknown, double apart,
                                             size_t most) {
  std::map<std::pair<DisagreementKind, Lie>, Layer> layers;
  for (size_t i = 0; i < pieces.size(); ++i) {
    const DisagreeingPiece& piece = pieces[i];
    layers[{piece.kind, LieOf(piece.through)}][CubeOf(piece.at, apart)].push_back(i);
  }
  std::vector<Disagreement> groups;
  std::map<Cube, size_t> behind;  // which group the cube is in
  for (auto& [key, layer] : layers) {
    while (!layer.empty()) {
      const Group members = TakeFirstGroup(layer);
      if (members.pieces.size() < kFewestPieces) continue;
      Disagreement& group = groups.emplace_back();
      group.kind = key.first;
      group.pieces = members.pieces.size();
      group.words = WordsFor(key.first, key.second);
      for (const size_t i : members.pieces) AddTo(group, pieces[i].at, pieces[i].area);
      if (key.first != DisagreementKind::kBehindSurface) continue;
      for (const Cube& cube : members.cubes) behind.emplace(cube, groups.size() - 1);
    }
  }
  for (const UnknownPiece& piece : unknown) {
    const auto found = behind.find(CubeOf(piece.at, apart));
    if (found != behind.end()) AddTo(groups[found->second], piece.at, piece.area);
  }
  std::erase_if(groups, [](const Disagreement& group) { return group.area < kLeastArea; });
  for (Disagreement& group : groups) group.centre /= group.area;
  std::stable_sort(groups.begin(), groups.end(),
                   [](const Disagreement& a, const Disagreement& b) { return a.area > b.area; });
  if (groups.size() > most) groups.resize(most);
  return groups;
}

}  // namespace vantage::registration
