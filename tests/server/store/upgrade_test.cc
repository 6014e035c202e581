// What release 0.1 stored, field by field under its old number, and what becomes of it: a case for
// each row of the tables.
#include "server/store/upgrade.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "google/protobuf/unknown_field_set.h"
#include "google/protobuf/util/field_mask_util.h"
#include "server/store/store.h"

namespace vantage::store {
namespace {

// The bytes of a message as another release wrote them, field by field.
class OldMessage {
 public:
  OldMessage& Text(int number, const std::string& text) {
    google::protobuf::UnknownFieldSet field;
    field.AddLengthDelimited(number, text);
    return Append(field);
  }
  OldMessage& Figure(int number, double value) {
    google::protobuf::UnknownFieldSet field;
    field.AddFixed64(number, std::bit_cast<uint64_t>(value));
    return Append(field);
  }
  OldMessage& Whole(int number, uint64_t value) {
    google::protobuf::UnknownFieldSet field;
    field.AddVarint(number, value);
    return Append(field);
  }
  OldMessage& Message(int number, const OldMessage& message) {
    return Text(number, message.Bytes());
  }
  const std::string& Bytes() const { return bytes_; }

 private:
  OldMessage& Append(const google::protobuf::UnknownFieldSet& field) {
    std::string more;
    EXPECT_TRUE(field.SerializeToString(&more));
    bytes_ += more;
    return *this;
  }

  std::string bytes_;
};

// An entry of format 1 whose event is `event`, field `kind` of SessionEvent, as it is read.
storage::v1::LogEntry ReadOld(int kind, const OldMessage& event, const std::string& method = "") {
  OldMessage entry;
  entry.Whole(1, 1).Message(3, OldMessage().Whole(1, 7).Message(kind, event));
  if (!method.empty()) entry.Message(4, OldMessage().Text(1, "id").Text(2, method));
  storage::v1::LogEntry read;
  EXPECT_TRUE(read.ParseFromString(entry.Bytes()));
  Upgrade(read);
  EXPECT_EQ(read.format_version(), kLogFormatVersion);
  EXPECT_EQ(read.event().sequence(), 7U);
  return read;
}

// Fields of SessionEvent.
constexpr int kSessionUpdated = 4;
constexpr int kScanRefused = 7;
constexpr int kPlanEnded = 13;
constexpr int kClaimReleased = 16;
constexpr int kScannerAdded = 20;

OldMessage VerdictBy(const std::string& decided_by) {
  OldMessage verdict;
  verdict.Whole(1, v1::REGISTRATION_OUTCOME_FAILED).Text(9, decided_by);
  return verdict;
}

v1::RegistrationVerdict UpgradedVerdict(const std::string& decided_by) {
  const OldMessage scan = OldMessage().Message(9, OldMessage().Message(11, VerdictBy(decided_by)));
  v1::RegistrationVerdict verdict = ReadOld(kScanRefused, OldMessage().Message(1, scan))
                                        .event()
                                        .scan_refused()
                                        .scan()
                                        .registration()
                                        .verdict();
  EXPECT_EQ(verdict.outcome(), v1::REGISTRATION_OUTCOME_FAILED);
  return verdict;
}

TEST(Upgrade, WhatDecidedIsABasis) {
  const std::pair<const char*, v1::RegistrationBasis> kTexts[] = {
      {"scan geometry", v1::REGISTRATION_BASIS_SCAN_GEOMETRY},
      {"levelling", v1::REGISTRATION_BASIS_LEVELLING},
      {"targets", v1::REGISTRATION_BASIS_TARGETS},
      {"trusted pose", v1::REGISTRATION_BASIS_TRUSTED_POSE},
      {"overlap", v1::REGISTRATION_BASIS_OVERLAP},
      {"no pose prior", v1::REGISTRATION_BASIS_NO_POSE_PRIOR},
      {"residuals", v1::REGISTRATION_BASIS_RESIDUALS},
      {"contradiction", v1::REGISTRATION_BASIS_CONTRADICTION},
      {"rival pose", v1::REGISTRATION_BASIS_RIVAL_POSE},
      {"convergence", v1::REGISTRATION_BASIS_NOT_CONVERGED},
      {"", v1::REGISTRATION_BASIS_UNSPECIFIED},
      {"something that 0.1 never said", v1::REGISTRATION_BASIS_UNSPECIFIED},
  };
  for (const auto& [text, basis] : kTexts) {
    const v1::RegistrationVerdict verdict = UpgradedVerdict(text);
    EXPECT_EQ(verdict.basis(), basis) << text;
    EXPECT_EQ(verdict.combined_bases_size(), 0) << text;
  }
}

TEST(Upgrade, SeveralThatDecidedTogetherAreNamed) {
  const std::pair<const char*, std::vector<int>> kTexts[] = {
      {"levelling and targets", {v1::REGISTRATION_BASIS_LEVELLING, v1::REGISTRATION_BASIS_TARGETS}},
      {"levelling and trusted pose",
       {v1::REGISTRATION_BASIS_LEVELLING, v1::REGISTRATION_BASIS_TRUSTED_POSE}},
      {"targets and trusted pose",
       {v1::REGISTRATION_BASIS_TARGETS, v1::REGISTRATION_BASIS_TRUSTED_POSE}},
      {"levelling and targets and trusted pose",
       {v1::REGISTRATION_BASIS_LEVELLING, v1::REGISTRATION_BASIS_TARGETS,
        v1::REGISTRATION_BASIS_TRUSTED_POSE}},
  };
  for (const auto& [text, bases] : kTexts) {
    const v1::RegistrationVerdict verdict = UpgradedVerdict(text);
    EXPECT_EQ(verdict.basis(), v1::REGISTRATION_BASIS_COMBINED) << text;
    EXPECT_THAT(verdict.combined_bases(), testing::ElementsAreArray(bases)) << text;
  }
}

TEST(Upgrade, EveryEventWithAScanIsTranslated) {
  const OldMessage scan =
      OldMessage()
          .Message(9, OldMessage().Figure(10, 1.5).Message(11, VerdictBy("rival pose")))
          .Message(16, OldMessage().Figure(6, 0.25).Figure(7, 2));
  for (const int kind : {5, 6, 7, 8, 9, 10, 11, 19}) {
    const storage::v1::LogEntry entry = ReadOld(kind, OldMessage().Message(1, scan));
    const google::protobuf::Message& event = entry.event();
    const auto* field = event.GetDescriptor()->FindFieldByNumber(kind);
    const google::protobuf::Message& happened = event.GetReflection()->GetMessage(event, field);
    v1::Scan read;
    read.CopyFrom(happened.GetReflection()->GetMessage(
        happened, happened.GetDescriptor()->FindFieldByName("scan")));
    EXPECT_EQ(read.registration().verdict().basis(), v1::REGISTRATION_BASIS_RIVAL_POSE) << kind;
    EXPECT_EQ(read.registration().duration().seconds(), 1) << kind;
    EXPECT_EQ(read.registration().duration().nanos(), 500'000'000) << kind;
    EXPECT_EQ(read.merge().carve_duration().nanos(), 250'000'000) << kind;
    EXPECT_EQ(read.merge().merge_duration().seconds(), 2) << kind;
  }
}

TEST(Upgrade, WhatIsNoTimeIsAbsent) {
  for (const double seconds :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -1.0}) {
    const OldMessage scan = OldMessage().Message(9, OldMessage().Figure(10, seconds));
    EXPECT_FALSE(ReadOld(kScanRefused, OldMessage().Message(1, scan))
                     .event()
                     .scan_refused()
                     .scan()
                     .registration()
                     .has_duration())
        << seconds;
  }
}

TEST(Upgrade, StagesOfAPlanAreEnums) {
  const std::pair<const char*, v1::PlanStage> kTexts[] = {
      {"feasible views", v1::PLAN_STAGE_FEASIBLE_VIEWS},
      {"extract patches", v1::PLAN_STAGE_EXTRACT_PATCHES},
      {"rank patches", v1::PLAN_STAGE_RANK_PATCHES},
      {"evaluate views", v1::PLAN_STAGE_EVALUATE_VIEWS},
      {"rank views", v1::PLAN_STAGE_RANK_VIEWS},
      {"registration check", v1::PLAN_STAGE_REGISTRATION_CHECK},
      {"something that 0.1 never said", v1::PLAN_STAGE_UNSPECIFIED},
  };
  OldMessage result;
  double seconds = 0.5;
  for (const auto& [text, stage] : kTexts) {
    result.Message(16, OldMessage().Text(1, text).Figure(2, seconds));
    seconds += 1;
  }
  const OldMessage plan = OldMessage().Message(9, result);
  const v1::PlanResult upgraded =
      ReadOld(kPlanEnded, OldMessage().Message(1, plan)).event().plan_ended().plan().result();
  ASSERT_EQ(upgraded.stage_durations_size(), static_cast<int>(std::size(kTexts)));
  for (int i = 0; i < upgraded.stage_durations_size(); ++i) {
    EXPECT_EQ(upgraded.stage_durations(i).stage(), kTexts[i].second) << kTexts[i].first;
    EXPECT_EQ(upgraded.stage_durations(i).duration().seconds(), i);
    EXPECT_EQ(upgraded.stage_durations(i).duration().nanos(), 500'000'000);
  }
}

// A result is stored as it is, too, and says nothing of its format.
TEST(Upgrade, ViewsOfAResultHaveDurationsAndBases) {
  const OldMessage view =
      OldMessage().Figure(3, 800).Message(17, VerdictBy("overlap")).Figure(19, 2.5);
  v1::PlanResult result;
  ASSERT_TRUE(result.ParseFromString(OldMessage().Message(4, view).Message(5, view).Bytes()));
  Upgrade(result);
  for (const v1::RankedView* read : {&result.views(0), &result.refused(0)}) {
    EXPECT_EQ(read->score(), 800);
    EXPECT_EQ(read->total_duration().seconds(), 150);
    EXPECT_EQ(read->verdict().basis(), v1::REGISTRATION_BASIS_OVERLAP);
  }
  const std::string once = result.SerializeAsString();
  Upgrade(result);
  EXPECT_EQ(result.SerializeAsString(), once);
}

// What 0.1 wrote as 0 was not written at all, and is absent; so it is what was not known.
TEST(Upgrade, BoundsThatWereNotKnownAreAbsent) {
  v1::PlanResult unknown;
  ASSERT_TRUE(unknown.ParseFromString(OldMessage().Message(9, OldMessage().Text(2, "?")).Bytes()));
  EXPECT_FALSE(unknown.termination().has_best_score_upper());
  EXPECT_FALSE(unknown.termination().has_best_model_gain_upper_m2());
  v1::PlanResult known;
  ASSERT_TRUE(known.ParseFromString(
      OldMessage().Message(9, OldMessage().Figure(3, 5000).Figure(4, 2)).Bytes()));
  EXPECT_EQ(known.termination().best_score_upper(), 5000);
  EXPECT_EQ(known.termination().best_model_gain_upper_m2(), 2);
}

TEST(Upgrade, WhatEndedAClaimIsAnEnum) {
  const std::pair<const char*, v1::ClaimEndReason> kTexts[] = {
      {"scan arrived", v1::CLAIM_END_REASON_SCAN_ARRIVED},
      {"expired", v1::CLAIM_END_REASON_EXPIRED},
      {"released", v1::CLAIM_END_REASON_RELEASED},
      {"something that 0.1 never said", v1::CLAIM_END_REASON_UNSPECIFIED},
  };
  for (const auto& [text, reason] : kTexts) {
    const v1::ClaimEndedEvent event =
        ReadOld(kClaimReleased, OldMessage().Text(2, text).Text(3, "sessions/s/scans/scan-1"))
            .event()
            .claim_ended();
    EXPECT_EQ(event.end_reason(), reason) << text;
    EXPECT_EQ(event.scan(), "sessions/s/scans/scan-1");
  }
}

TEST(Upgrade, AScannersTimeIsADurationAndItsRequestHasItsNewName) {
  const storage::v1::LogEntry entry =
      ReadOld(kScannerAdded, OldMessage().Message(1, OldMessage().Text(1, "name").Figure(8, 90.5)),
              "AddScanner");
  const v1::Scanner& scanner = entry.event().scanner_created().scanner();
  EXPECT_EQ(scanner.name(), "name");
  EXPECT_EQ(scanner.scan_duration().seconds(), 90);
  EXPECT_EQ(scanner.scan_duration().nanos(), 500'000'000);
  EXPECT_EQ(entry.request().method(), "CreateScanner");
  EXPECT_EQ(ReadOld(kScannerAdded, OldMessage(), "ClaimView").request().method(), "ClaimView");
}

TEST(Upgrade, UpdatedFieldsHaveTheirNewNames) {
  const std::pair<const char*, const char*> kPaths[] = {
      {"display_name", "display_name"},
      {"scanner_models", "scanner_models"},
      {"site_rules.keep_out", "site_rules.keep_out"},
      {"planning_config", "planning_config"},
      {"planning_config.confidence", "planning_config.confidence"},
      {"planning_config.required_density", "planning_config.required_density_per_m2"},
      {"planning_config.viewcell_size", "planning_config.viewcell_size_m"},
      {"planning_config.min_height", "planning_config.min_viewpoint_height_m"},
      {"planning_config.max_height", "planning_config.max_viewpoint_height_m"},
      {"planning_config.floor_height", "planning_config.floor_z_m"},
      {"planning_config.scanner_width", "planning_config.scanner_width_m"},
      {"planning_config.scanner_height", "planning_config.scanner_height_m"},
      {"planning_config.separation", "planning_config.candidate_separation_m"},
      {"planning_config.candidates", "planning_config.max_view_count"},
      {"planning_config.max_checked", "planning_config.max_checked_view_count"},
      {"planning_config.terminate_below", "planning_config.terminate_below_m2"},
      {"planning_config.min_patch_area", "planning_config.min_patch_area_m2"},
      {"planning_config.depth_behind", "planning_config.unknown_depth_m"},
      {"planning_config.least_deficit", "planning_config.min_deficit_share"},
      {"planning_config.counts_from", "planning_config.min_counted_density_share"},
      {"planning_config.registration.seed", "planning_config.registration.seed"},
      {"planning_config.registration.required_accuracy",
       "planning_config.registration.required_accuracy_m"},
      {"planning_config.registration.minimum_overlap", "planning_config.registration.min_overlap"},
      {"planning_config.registration.correlation_length",
       "planning_config.registration.correlation_length_m"},
      {"planning_config.registration.correlated_sigma",
       "planning_config.registration.correlated_sigma_m"},
      {"planning_config.registration.normal_sigma",
       "planning_config.registration.normal_sigma_rad"},
      {"planning_config.registration.sample_spacing",
       "planning_config.registration.sample_spacing_m"},
      {"planning_config.registration.max_correspondence",
       "planning_config.registration.max_correspondence_distance_m"},
      {"planning_config.registration.draws", "planning_config.registration.draw_count"},
  };
  OldMessage event;
  for (const auto& [old_path, new_path] : kPaths) event.Text(2, old_path);
  const google::protobuf::FieldMask mask =
      ReadOld(kSessionUpdated, event).event().session_updated().update_mask();
  ASSERT_EQ(mask.paths_size(), static_cast<int>(std::size(kPaths)));
  for (int i = 0; i < mask.paths_size(); ++i) {
    EXPECT_EQ(mask.paths(i), kPaths[i].second);
    EXPECT_TRUE(google::protobuf::util::FieldMaskUtil::IsValidPath<v1::Session>(mask.paths(i)))
        << mask.paths(i);
  }
}

TEST(Upgrade, AnEntryOfThisFormatStaysAsItIs) {
  storage::v1::LogEntry entry;
  const OldMessage scan = OldMessage().Message(9, OldMessage().Message(11, VerdictBy("targets")));
  const OldMessage event = OldMessage().Message(kScanRefused, OldMessage().Message(1, scan));
  ASSERT_TRUE(
      entry.ParseFromString(OldMessage().Whole(1, kLogFormatVersion).Message(3, event).Bytes()));
  const std::string before = entry.SerializeAsString();
  Upgrade(entry);
  EXPECT_EQ(entry.SerializeAsString(), before);
}

}  // namespace
}  // namespace vantage::store
