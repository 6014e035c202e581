// The floors in the middle of columns of viewcells: between them a scanner is carried
// (algorithm.md section 7A, 'Reachability').
#ifndef VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_NODES_H_
#define VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_NODES_H_

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/planning/feasibility/floor_pieces.h"

namespace vantage::planning {

// Any number of nodes in each column of a rectangle, one for each floor.
class FloorNodes {
 public:
  FloorNodes() = default;  // of no columns
  // Columns [first, first + size) of edge `cell_size` (m): column c covers [c, c + 1) * cell_size.
  FloorNodes(const Eigen::Vector2i& first, const Eigen::Vector2i& size, double cell_size);

  // Appends the nodes of the next column, by y, x: their heights, m, ascending.
  void AddColumn(const std::vector<float>& heights);
  // Adds one to a column that has its nodes already, and returns it. Nodes behind it move up by
  // one.
  uint32_t Insert(const Eigen::Vector2i& column, float height);

  const Eigen::Vector2i& first() const { return first_; }
  const Eigen::Vector2i& size() const { return size_; }
  double cell_size() const { return cell_size_; }
  size_t count() const { return height_.size(); }
  bool Inside(const Eigen::Vector2i& column) const {
    return ((column - first_).array() >= 0).all() &&
           ((column - first_).array() < size_.array()).all();
  }
  Eigen::Vector2i ColumnAt(const Eigen::Vector3d& p) const {
    return (p.head<2>() / cell_size_).array().floor().cast<int>();
  }
  // z of the floor, m.
  float Height(uint32_t node) const { return height_[node]; }
  const Eigen::Vector2i& Column(uint32_t node) const { return column_[node]; }
  // A column's nodes, [begin, end), from the lowest up; none outside.
  std::pair<uint32_t, uint32_t> In(const Eigen::Vector2i& column) const {
    if (!Inside(column)) return {0, 0};
    const size_t at = Index(column);
    return {begin_[at], begin_[at + 1]};
  }
  // The node that a place stands on: of its column the highest at or below it, or else the lowest.
  std::optional<uint32_t> Under(const Eigen::Vector3d& p) const;
  // Calls fn(node) for the nodes of neighbouring columns, diagonals included, that are at most a
  // step higher or lower; by y, x, height.
  template <typename Fn>
  void ForEachStep(uint32_t from, Fn&& fn) const {
    const Eigen::Vector2i c = Column(from);
    for (int y = c.y() - 1; y <= c.y() + 1; ++y) {
      for (int x = c.x() - 1; x <= c.x() + 1; ++x) {
        const auto [begin, end] = In({x, y});
        for (uint32_t to = begin; to < end; ++to) {
          if (to != from && IsStep(from, to)) fn(to);
        }
      }
    }
  }
  // True when the heights of two nodes differ by a step at most.
  bool IsStep(uint32_t from, uint32_t to) const {
    return static_cast<double>(std::abs(height_[to] - height_[from])) <= kMaxStep;
  }

 private:
  size_t Index(const Eigen::Vector2i& column) const {
    return static_cast<size_t>(column.x() - first_.x()) +
           static_cast<size_t>(size_.x()) * static_cast<size_t>(column.y() - first_.y());
  }

  Eigen::Vector2i first_ = Eigen::Vector2i::Zero();
  Eigen::Vector2i size_ = Eigen::Vector2i::Zero();
  double cell_size_ = 0;
  std::vector<uint32_t> begin_ = {0};    // of each column its first node; one more at the end
  std::vector<Eigen::Vector2i> column_;  // by node
  std::vector<float> height_;            // by node
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_NODES_H_
