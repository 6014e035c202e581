#include "core/connectivity/connectivity.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "core/simulation/random_sequence.h"

namespace vantage::connectivity {
namespace {

constexpr uint32_t kNobody = UINT32_MAX;

// Sizes of the pieces without a station and a link, by spreading.
std::vector<size_t> Pieces(size_t stations, const std::vector<StationLink>& links, uint32_t without,
                           size_t without_link) {
  std::vector<uint32_t> piece(stations);
  for (uint32_t i = 0; i < stations; ++i) piece[i] = i;
  for (size_t round = 0; round < stations; ++round) {
    for (size_t l = 0; l < links.size(); ++l) {
      const auto [a, b, sigma] = links[l];
      if (l == without_link || a == without || b == without) continue;
      piece[a] = piece[b] = std::min(piece[a], piece[b]);
    }
  }
  std::map<uint32_t, size_t> sizes;
  for (uint32_t i = 0; i < stations; ++i) {
    if (i != without) ++sizes[piece[i]];
  }
  std::vector<size_t> list;
  list.reserve(sizes.size());
  for (const auto& [name, size] : sizes) list.push_back(size);
  return list;
}

std::vector<StationLink> RandomLinks(uint64_t seed, uint32_t stations) {
  simulation::RandomSequence random(seed);
  std::vector<StationLink> links;
  const size_t count = stations - 1 + random.Below(4);
  for (size_t l = 0; l < count; ++l) {
    const auto a = static_cast<uint32_t>(random.Below(stations));
    const auto b = static_cast<uint32_t>(random.Below(stations));
    if (a != b) links.push_back({a, b, random.Between(0.001, 0.01)});
  }
  if (seed % 3 == 0 && !links.empty()) links.push_back(links.front());  // two between the same
  return links;
}

TEST(Connectivity, IsWhatRemovingEachStationAndLinkShows) {
  size_t cuts = 0;
  size_t bridges = 0;
  for (uint64_t seed = 1; seed <= 200; ++seed) {
    const uint32_t stations = 3 + seed % 10;
    const std::vector<StationLink> links = RandomLinks(seed, stations);
    const auto measured = MeasureConnectivity(stations, links);
    ASSERT_TRUE(measured.ok()) << measured.status();
    const std::vector<size_t> whole = Pieces(stations, links, kNobody, SIZE_MAX);
    EXPECT_EQ(measured->pieces, whole.size()) << "seed " << seed;
    std::map<uint32_t, size_t> found;
    for (const CutStation& cut : measured->cuts) found[cut.station] = cut.cut_off;
    for (uint32_t i = 0; i < stations; ++i) {
      const std::vector<size_t> without = Pieces(stations, links, i, SIZE_MAX);
      bool alone = true;
      for (const StationLink& link : links) alone &= link.a != i && link.b != i;
      const bool cuts_it = without.size() > whole.size() - (alone ? 1 : 0);
      EXPECT_EQ(found.contains(i), cuts_it) << "seed " << seed << ", station " << i;
      if (!cuts_it) continue;
      // Its piece's parts are those that are not pieces of the whole.
      std::vector<size_t> parts = without;
      for (const size_t size : whole) {
        if (const auto at = std::find(parts.begin(), parts.end(), size);
            at != parts.end() && parts.size() > without.size() - whole.size() + 1) {
          parts.erase(at);
        }
      }
      size_t sum = 0;
      for (const size_t part : parts) sum += part;
      EXPECT_EQ(found[i], sum - *std::max_element(parts.begin(), parts.end()))
          << "seed " << seed << ", station " << i;
      ++cuts;
    }
    std::map<size_t, size_t> weak;
    for (const Bridge& bridge : measured->bridges) weak[bridge.link] = bridge.cut_off;
    for (size_t l = 0; l < links.size(); ++l) {
      const bool bridge = Pieces(stations, links, kNobody, l).size() > whole.size();
      EXPECT_EQ(weak.contains(l), bridge) << "seed " << seed << ", link " << l;
      bridges += bridge ? 1 : 0;
    }
  }
  EXPECT_GT(cuts, 200u);
  EXPECT_GT(bridges, 200u);
}

TEST(Connectivity, MeansAreThoseOfTheBestPaths) {
  for (uint64_t seed = 1; seed <= 60; ++seed) {
    const uint32_t stations = 4 + seed % 8;
    const std::vector<StationLink> links = RandomLinks(seed, stations);
    // Floyd and Warshall's.
    constexpr double kNone = std::numeric_limits<double>::infinity();
    std::vector<std::vector<double>> least(stations, std::vector<double>(stations, kNone));
    for (const StationLink& link : links) {
      const double variance = link.sigma * link.sigma;
      least[link.a][link.b] = std::min(least[link.a][link.b], variance);
      least[link.b][link.a] = least[link.a][link.b];
    }
    for (size_t k = 0; k < stations; ++k) {
      for (size_t i = 0; i < stations; ++i) {
        for (size_t j = 0; j < stations; ++j) {
          least[i][j] = std::min(least[i][j], least[i][k] + least[k][j]);
        }
      }
    }
    double sum = 0;
    double longest = 0;
    uint64_t pairs = 0;
    for (size_t i = 0; i < stations; ++i) {
      for (size_t j = i + 1; j < stations; ++j) {
        if (least[i][j] == kNone) continue;
        ++pairs;
        sum += std::sqrt(least[i][j]);
        longest = std::max(longest, std::sqrt(least[i][j]));
      }
    }
    const auto measured = MeasureConnectivity(stations, links);
    ASSERT_TRUE(measured.ok()) << measured.status();
    EXPECT_EQ(measured->tied_pairs, pairs) << "seed " << seed;
    EXPECT_NEAR(measured->mean_path_sigma, pairs > 0 ? sum / static_cast<double>(pairs) : 0, 1e-12);
    EXPECT_NEAR(measured->longest_path_sigma, longest, 1e-12);
  }
}

TEST(Connectivity, OfTwoRoomsWithOneStationAtTheDoor) {
  // 0, 1, 2 in a room and 4, 5, 6 in the next, all tied within it, and 3 at the door.
  const std::vector<StationLink> links = {{0, 1, 1}, {1, 2, 1}, {0, 2, 1}, {2, 3, 2},
                                          {3, 4, 2}, {4, 5, 1}, {5, 6, 1}, {4, 6, 1}};
  const auto measured = MeasureConnectivity(7, links);
  ASSERT_TRUE(measured.ok()) << measured.status();
  ASSERT_EQ(measured->cuts.size(), 3u);
  EXPECT_EQ(measured->cuts[0].station, 3u);
  EXPECT_EQ(measured->cuts[0].cut_off, 3u);
  EXPECT_EQ(measured->cuts[1].station, 2u);
  EXPECT_EQ(measured->cuts[1].cut_off, 2u);
  EXPECT_EQ(measured->cuts[2].station, 4u);
  ASSERT_EQ(measured->bridges.size(), 2u);
  EXPECT_EQ(measured->bridges[0].link, 3u);
  EXPECT_EQ(measured->bridges[0].cut_off, 3u);
  EXPECT_NEAR(measured->longest_path_sigma, std::sqrt(1 + 4 + 4 + 1), 1e-12);
}

TEST(Connectivity, NothingIsNoErrorAndNonsenseIs) {
  EXPECT_EQ(MeasureConnectivity(0, {})->pieces, 0u);
  const auto two = MeasureConnectivity(2, {});
  EXPECT_EQ(two->pieces, 2u);
  EXPECT_EQ(two->tied_pairs, 0u);
  EXPECT_EQ(two->mean_path_sigma, 0);
  for (const StationLink& wrong : {StationLink{0, 2, 1}, StationLink{1, 1, 1}, StationLink{0, 1, 0},
                                   StationLink{0, 1, std::nan("")}}) {
    EXPECT_EQ(MeasureConnectivity(2, std::vector{wrong}).status().code(),
              absl::StatusCode::kInvalidArgument);
  }
}

}  // namespace
}  // namespace vantage::connectivity
