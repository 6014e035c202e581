#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "server/report/sections.h"

namespace vantage::report {
namespace {

using Column = HtmlTable::Column;

// Places that are told one by one.
constexpr int kMostPlaces = 10;
constexpr double kLeastGivenUp = 0.25;  // m2
constexpr int kMostOpenings = 200;
constexpr int kMostRejections = 200;

// Surface of one storey, m2.
struct StoreyArea {
  double at_density = 0;
  double thin = 0;
  std::array<double, model::kSurfaceKinds> missing{};  // by SurfaceKind, of what is false
  double given_up = 0;
};

std::vector<StoreyArea> AreaByStorey(const JobRecord& job,
                                     const std::vector<ReportStorey>& storeys) {
  // The slab between two storeys belongs to the lower one; its upper face to the one above.
  constexpr double kBelowFloor = 0.1;  // m
  std::vector<StoreyArea> areas(storeys.size());
  job.view->ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel& surface) {
        const Eigen::Vector3d place = surface.centroid.cast<double>();
        const std::optional<planning::Requirement> required = job.config.RequiredAt(place);
        if (!required.has_value()) return;
        const double z = place.z() + job.origin.z();
        size_t at = 0;
        while (at + 1 < storeys.size() && z >= storeys[at + 1].band.floor - kBelowFloor) ++at;
        StoreyArea& area = areas[at];
        const double m2 = surface.area;
        const bool dense = state == model::VoxelState::kTrueSurface &&
                           static_cast<double>(surface.density) >= required->density;
        if (dense) {
          area.at_density += m2;
        } else if (state == model::VoxelState::kTrueSurface) {
          area.thin += m2;
        } else {
          area.missing[static_cast<size_t>(model::KindOf(state))] += m2;
        }
        if (surface.given_up && !dense) area.given_up += m2;
      });
  return areas;
}

Html StoreyTable(const JobRecord& job, const Words& say) {
  const std::vector<ReportStorey> storeys = StoreysOf(job);
  const std::vector<StoreyArea> areas = AreaByStorey(job, storeys);
  HtmlTable table(say(Text::kByStoreyCaption), {{say(Text::kStoreyColumn)},
                                                {say(Text::kAtDensity), Column::kNumber},
                                                {say(Text::kThinColumn), Column::kNumber},
                                                {say(Text::kHiddenColumn), Column::kNumber},
                                                {say(Text::kNoEchoColumn), Column::kNumber},
                                                {say(Text::kOutsideColumn), Column::kNumber},
                                                {say(Text::kGivenUpColumn), Column::kNumber}});
  for (size_t i = storeys.size(); i-- > 0;) {
    const StoreyArea& area = areas[i];
    table.Add({StoreyTitle(storeys[i], say), say.Area(area.at_density), say.Area(area.thin),
               say.Area(area.missing[1]), say.Area(area.missing[2]), say.Area(area.missing[3]),
               say.Area(area.given_up)});
  }
  return table.Done();
}

Html RegionTable(const Standing& standing, const Words& say) {
  HtmlTable table(say(Text::kByRegionCaption), {{say(Text::kRegion)},
                                                {say(Text::kAtDensity), Column::kNumber},
                                                {say(Text::kThinColumn), Column::kNumber},
                                                {say(Text::kHiddenColumn), Column::kNumber},
                                                {say(Text::kNoEchoColumn), Column::kNumber},
                                                {say(Text::kOutsideColumn), Column::kNumber},
                                                {say(Text::kGivenUpColumn), Column::kNumber},
                                                {say(Text::kOutOfReachColumn), Column::kNumber}});
  for (const RegionStanding& region : standing.regions) {
    if (!region.required) continue;
    const bool whole = region.name.empty();
    table.Add({whole ? say(Text::kWholeJob) : region.name, say.Area(region.area_at_density),
               say.Area(std::max(0.0, region.area.true_surface() - region.area_at_density)),
               say.Area(region.area.occlusion()), say.Area(region.area.hole_boundary()),
               say.Area(region.area.image_boundary()), say.Area(region.area_given_up),
               say.Area(region.area_out_of_reach)},
              whole && standing.regions.size() > 1 ? "total" : "");
  }
  return table.Done();
}

Text KindText(v1::SurfaceKind kind) {
  switch (kind) {
    case v1::SURFACE_KIND_TRUE:
      return Text::kKindThin;
    case v1::SURFACE_KIND_OCCLUSION:
      return Text::kKindHidden;
    case v1::SURFACE_KIND_HOLE_BOUNDARY:
      return Text::kKindNoEcho;
    default:
      return Text::kKindOutside;
  }
}

// The largest places where surface is missing, by the last plan, and those that are given up.
Html Places(const JobRecord& job, const Words& say) {
  const std::vector<ReportStorey> storeys = StoreysOf(job);
  const auto storey_of = [&](double z) {
    return absl::StrCat(storeys[StoreyAt(storeys, z)].number);
  };
  Html out;
  if (job.coverage.patches_size() > 0) {
    HtmlTable table(say(Text::kPatchesCaption, LastPart(job.coverage.plan())),
                    {{say(Text::kWhereColumn)},
                     {say(Text::kStoreyColumn)},
                     {say(Text::kWhyColumn)},
                     {say(Text::kSizeColumn), Column::kNumber},
                     {say(Text::kAreaColumn), Column::kNumber}});
    // The contract has the most important ones first.
    std::vector<v1::Patch> largest(job.coverage.patches().begin(), job.coverage.patches().end());
    std::stable_sort(largest.begin(), largest.end(), [](const v1::Patch& a, const v1::Patch& b) {
      return a.area_m2() > b.area_m2();
    });
    largest.resize(std::min<size_t>(largest.size(), kMostPlaces));
    for (const v1::Patch& patch : largest) {
      table.Add({say.Place(patch.centre()), storey_of(patch.centre().z()),
                 say(KindText(patch.kind())),
                 absl::StrCat(say.Number(patch.length_u_m(), 1), " \u00d7 ",
                              say.Number(patch.length_v_m(), 1), " m"),
                 say.Area(patch.area_m2())});
    }
    out += table.Done();
  }
  if (job.coverage.given_up_size() > 0) {
    HtmlTable table(say(Text::kGivenUpCaption), {{say(Text::kWhereColumn)},
                                                 {say(Text::kStoreyColumn)},
                                                 {say(Text::kWhyColumn)},
                                                 {say(Text::kAreaColumn), Column::kNumber}});
    int shown = 0;
    for (const v1::GivenUpSurface& place : job.coverage.given_up()) {
      // Smaller ones are in the sums.
      if (shown == kMostPlaces || place.area_m2() < kLeastGivenUp) break;
      ++shown;
      table.Add(
          {say.Place(place.centre()), storey_of(place.centre().z()),
           say(place.kind() == v1::SURFACE_KIND_TRUE ? Text::kGivenUpThin : Text::kGivenUpUnseen),
           say.Area(place.area_m2())});
    }
    if (!table.empty()) out += table.Done();
  }
  return out;
}

Html Openings(const JobRecord& job, const Words& say) {
  const v1::Coverage& coverage = job.coverage.coverage();
  Html out = Element("h3", say(Text::kRoomsHeading));
  HtmlTable table(say(Text::kRoomsCaption), {{say(Text::kWhereColumn)},
                                             {say(Text::kStoreyColumn)},
                                             {say(Text::kDoorSizeColumn), Column::kNumber},
                                             {say(Text::kSeenBehindColumn), Column::kNumber},
                                             {say(Text::kEndsColumn), Column::kNumber}});
  int left = 0;
  std::set<std::array<int64_t, 3>> told;
  for (const v1::Opening& opening : coverage.openings()) {
    if (!opening.doorway() || opening.entered() || opening.frontier_area_behind_m2() <= 0) continue;
    // A doorway that leads to several pieces of space that are known is one.
    if (!told.insert({opening.storey_index(), std::llround(10 * opening.centre().x()),
                      std::llround(10 * opening.centre().y())})
             .second) {
      continue;
    }
    if (++left > kMostOpenings) continue;
    table.Add({say.Place(opening.centre()), absl::StrCat(opening.storey_index()),
               absl::StrCat(say.Number(opening.width_m(), 2), " \u00d7 ",
                            say.Number(opening.height_m(), 2), " m"),
               say.Area(opening.free_area_behind_m2()),
               say.Area(opening.frontier_area_behind_m2())});
  }
  out += table.empty() ? Element("p", say(Text::kNoRooms)) : table.Done();
  if (left > kMostOpenings) {
    out += Element("p", say(Text::kMoreRows, left - kMostOpenings), "class=\"note\"");
  }
  const auto& ways = job.plan.result().narrow_ways();
  if (!ways.empty()) {
    HtmlTable narrow(say(Text::kNarrowCaption), {{say(Text::kWhereColumn)},
                                                 {say(Text::kWidthColumn), Column::kNumber},
                                                 {say(Text::kBehindColumn), Column::kNumber}});
    for (const v1::NarrowWay& way : ways) {
      narrow.Add({say.Place(way.narrowest()), say.Length(way.width_m()),
                  say.Area(std::max(way.model_gain_m2(), way.expected_gain_m2()))});
    }
    out += narrow.Done();
  }
  return out;
}

Html Rejections(const JobRecord& job, const Words& say) {
  Html out = Element("h3", say(Text::kRejectionsHeading));
  if (job.session.rejections().empty()) return out + Element("p", say(Text::kNone));
  HtmlTable table(say(Text::kRejectionsCaption), {{say(Text::kWhereColumn)},
                                                  {say(Text::kRadiusColumn), Column::kNumber},
                                                  {say(Text::kReasonColumn)},
                                                  {say(Text::kSinceColumn)},
                                                  {say(Text::kUntilColumn)}});
  int shown = 0;
  for (const v1::Rejection& rejection : job.session.rejections()) {
    if (++shown > kMostRejections) continue;
    table.Add(
        {say.Place(rejection.position()), say.Length(rejection.radius_m()),
         rejection.reason().empty() ? say(Text::kNoReason) : rejection.reason(),
         say.Time(rejection.create_time()),
         rejection.has_expire_time() ? say.Time(rejection.expire_time()) : say(Text::kForGood)});
  }
  out += table.Done();
  if (shown > kMostRejections) {
    out += Element("p", say(Text::kMoreRows, shown - kMostRejections), "class=\"note\"");
  }
  return out;
}

}  // namespace

Html WriteRemaining(const JobRecord& job, const Standing& standing, const Words& say) {
  Html out = Html::Raw("<section class=\"page\" id=\"remaining\">\n");
  out += Element("h2", say(Text::kRemaining));
  if (job.view == nullptr) {
    return out + Element("p", say(Text::kNoneInModel)) + Html::Raw("</section>\n");
  }
  out += Element("p", say(Text::kKindsNote), "class=\"note\"");
  out += RegionTable(standing, say);
  out += StoreyTable(job, say);
  out += Places(job, say);
  out += Openings(job, say);
  out += Rejections(job, say);
  return out + Html::Raw("</section>\n");
}

}  // namespace vantage::report
