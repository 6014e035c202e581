#include "server/session/stations.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/fleet/pending_stations.h"
#include "server/contract/error.h"
#include "server/contract/resource_names.h"
#include "server/conversion/fleet_proto.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"
#include "server/session/asked_evaluation.h"
#include "server/session/pledged_views.h"

namespace vantage::session {
namespace {

constexpr char kStationType[] = "vantage/Station";
constexpr absl::Duration kRetryStationAfter = absl::Seconds(1);

std::optional<double> HeadingOf(const v1::Station& station) {
  return station.has_heading_rad() ? std::optional(station.heading_rad()) : std::nullopt;
}

std::string ForecastWords(const fleet::StationForecast& forecast) {
  const std::string gain =
      absl::StrFormat("%.1f m2 should come to the required density", forecast.model_gain);
  if (!forecast.registers) {
    return absl::StrCat(gain, "; its scan is not predicted to register: ", forecast.why_not);
  }
  return forecast.waits ? absl::StrCat(gain, "; its scan registers once those before it are in")
                        : absl::StrCat(gain, "; its scan is predicted to register");
}

}  // namespace

Stations::Stations(SessionContext& context, ModelMemory& model)
    : context_(context),
      journal_(context.journal()),
      dependencies_(context.dependencies()),
      model_(model) {}

void Stations::Create(const v1::CreateStationRequest& request,
                      std::function<void(absl::StatusOr<v1::CreateStationResponse>)> done) {
  const v1::Station& asked = request.station();
  contract::Violations violations;
  std::string model_id = asked.scanner_model_id();
  journal_.Read([&](const SessionState& state) {
    const auto it = state.scanners.find(asked.scanner());
    if (!asked.scanner().empty() && it == state.scanners.end()) {
      violations.Add("station.scanner",
                     absl::StrCat("'", asked.scanner(), "' is no scanner of this session"));
    } else if (model_id.empty() && it != state.scanners.end()) {
      model_id = conversion::ModelOf(it->second, state.session).id();
    }
    if (!model_id.empty() && conversion::FindModel(model_id, state.session) == nullptr) {
      violations.Add("station.scanner_model_id",
                     absl::StrCat("'", model_id, "' is none of the session's scanner models"));
    }
  });
  absl::Status valid = violations.ToStatus();
  if (!valid.ok()) return done(valid);
  absl::StatusOr<PlanInputs> inputs = ReadPlanInputs(context_, model_, model_id, {}, "station.");
  if (!inputs.ok()) {
    if (contract::ReasonOf(inputs.status()) != "MODEL_EMPTY") return done(inputs.status());
    inputs = PlanInputs();  // before the first scan nothing is foreseen
  } else if (absl::Status room = ReserveMemory(model_, *inputs); !room.ok()) {
    return done(room);
  }
  std::shared_ptr<Evaluation> evaluation = model_.BeginEvaluation();
  if (evaluation == nullptr) {
    return done(contract::Retryable(absl::StatusCode::kResourceExhausted, "TOO_MANY_EVALUATIONS",
                                    "too many positions of this session are being evaluated",
                                    kRetryStationAfter));
  }
  RunAsked<v1::CreateStationResponse>(
      context_, std::move(evaluation), std::move(done),
      [this, in = *std::move(inputs),
       request](parallel::Parallel& parallel) -> absl::StatusOr<v1::CreateStationResponse> {
        absl::StatusOr<v1::Station> station = CreateNow(request, in, parallel);
        if (!station.ok()) return station.status();
        v1::CreateStationResponse response;
        *response.mutable_station() = *std::move(station);
        return response;
      });
}

absl::StatusOr<v1::Station> Stations::CreateNow(const v1::CreateStationRequest& request,
                                                const PlanInputs& inputs,
                                                parallel::Parallel& parallel) {
  v1::Station station = request.station();
  const RequestKey key = RequestKey::Of(request.request_id(), "CreateStation", request);
  bool known = false;
  std::vector<fleet::PledgedView> before;
  journal_.Read([&](const SessionState& state) {
    known = state.requests.count(key.id) > 0;
    before = ClaimedViews(state, context_.origin());
    const std::vector<fleet::PledgedView> pending = PendingViews(state, context_.origin());
    before.insert(before.end(), pending.begin(), pending.end());
  });
  station.clear_model_gain_m2();
  station.clear_message();
  if (inputs.model.view == nullptr) {
    if (!station.has_loss_chance()) station.set_loss_chance(fleet::kLossOtherwise);
    station.set_message("before the first scan nothing is foreseen of it");
  } else if (!known) {
    absl::Status forecast = Forecast(inputs, before, parallel, station);
    if (!forecast.ok()) return forecast;
  }
  absl::StatusOr<std::string> name =
      journal_.Execute(key, [&](const SessionState& state) -> absl::StatusOr<Draft> {
        if (absl::Status room = context_.CheckLog(); !room.ok()) return room;
        if (!station.scanner().empty() && state.scanners.count(station.scanner()) == 0) {
          return contract::ResourceNotFound("vantage/Scanner", station.scanner());
        }
        if (state.station_order.size() >= dependencies_.limits.stations_per_session) {
          return contract::ErrorWithReason(
              absl::StatusCode::kResourceExhausted, "STATIONS_FULL",
              absl::StrCat("the session waits for the scans of ", state.station_order.size(),
                           " stations, the most it may; send their scans, or delete some"));
        }
        Draft draft;
        station.set_name(contract::ChildName(context_.id(), "stations",
                                             absl::StrCat("station-", state.station_count + 1)));
        *station.mutable_create_time() = conversion::WriteTime(journal_.Now());
        *draft.event.mutable_station_created()->mutable_station() = station;
        return draft;
      });
  if (!name.ok()) return name.status();
  return Get(*name);
}

absl::Status Stations::Forecast(const PlanInputs& inputs,
                                const std::vector<fleet::PledgedView>& before,
                                parallel::Parallel& parallel, v1::Station& station) const {
  const absl::StatusOr<fleet::StationForecast> forecast = dependencies_.algorithms.forecast_station(
      *inputs.model.view, inputs.scanner, inputs.config,
      conversion::ReadOwnVector(station.position()) - context_.origin(), HeadingOf(station), before,
      parallel);
  if (!forecast.ok()) return forecast.status();
  station.set_model_gain_m2(forecast->model_gain);
  if (!station.has_loss_chance()) station.set_loss_chance(forecast->loss_chance);
  station.set_message(ForecastWords(*forecast));
  return absl::OkStatus();
}

absl::StatusOr<v1::Station> Stations::Get(const std::string& name) const {
  absl::StatusOr<v1::Station> station = contract::ResourceNotFound(kStationType, name);
  journal_.Read([&](const SessionState& state) {
    const auto it = state.stations.find(name);
    if (it != state.stations.end()) station = it->second;
  });
  return station;
}

absl::StatusOr<std::vector<v1::Station>> Stations::List(
    absl::string_view after, size_t limit, bool& more,
    const v1::ListStationsRequest& filter) const {
  std::vector<v1::Station> stations;
  absl::StatusOr<int64_t> last = 0;
  more = false;
  journal_.Read([&](const SessionState& state) {
    last = NumberAfter(after, state.station_count);
    if (!last.ok()) return;
    for (const std::string& name : state.station_order) {
      const v1::Station& station = state.stations.at(name);
      if (contract::NumberOf(name) <= *last) continue;
      if (!filter.scanner().empty() && station.scanner() != filter.scanner()) continue;
      if (stations.size() == limit) {
        more = true;
        return;
      }
      stations.push_back(station);
    }
  });
  if (!last.ok()) return last.status();
  return stations;
}

absl::Status Stations::Delete(const std::string& name, const RequestKey& key) {
  return End(name, v1::STATION_END_REASON_DELETED, "", key);
}

void Stations::Resume() {
  std::vector<std::pair<std::string, std::string>> arrived;
  journal_.Read([&](const SessionState& state) {
    for (const std::string& name : state.scan_order) {
      const ScanRecord& record = state.scans.at(name);
      if (!record.in_model || !record.scan.has_pose()) continue;
      const std::string station = OfScan(state, record.scan);
      if (station.empty()) continue;
      const absl::Time merged = conversion::ReadTime(record.scan.update_time());
      if (merged >= conversion::ReadTime(state.stations.at(station).create_time())) {
        arrived.emplace_back(station, name);
      }
    }
  });
  for (const auto& [station, scan] : arrived) Arrived(station, scan).IgnoreError();
}

std::string Stations::OfScan(const SessionState& state, const v1::Scan& scan) const {
  std::vector<fleet::PendingStation> pending;
  for (const std::string& name : state.station_order) {
    const v1::Station& station = state.stations.at(name);
    const fleet::PledgedView view =
        conversion::ReadStation(station, state.scanners, state.session, context_.origin());
    // Where the scanner turns all around, its heading says nothing.
    const bool sector = !view.model.TurnsAllAround();
    pending.push_back({station.scanner(), view.position, sector ? view.heading : std::nullopt,
                       view.model.azimuth_span});
  }
  const Eigen::Isometry3d T_model_scan = conversion::ReadOwnPose(scan.pose(), context_.origin());
  const Eigen::Vector3d front = T_model_scan.linear().col(0);
  const std::optional<size_t> of = fleet::StationOfScan(
      pending, scan.scanner(), T_model_scan.translation(), std::atan2(front.y(), front.x()));
  return of.has_value() ? state.station_order[*of] : "";
}

absl::Status Stations::Arrived(const std::string& station, const std::string& scan) {
  return End(station, v1::STATION_END_REASON_SCAN_ARRIVED, scan, {});
}

absl::Status Stations::End(const std::string& name, v1::StationEndReason how,
                           const std::string& scan, const RequestKey& key) {
  return journal_
      .Execute(key,
               [&](const SessionState& state) -> absl::StatusOr<Draft> {
                 const auto it = state.stations.find(name);
                 if (it == state.stations.end()) {
                   return contract::ResourceNotFound(kStationType, name);
                 }
                 Draft draft;
                 v1::StationEndedEvent& event = *draft.event.mutable_station_ended();
                 *event.mutable_station() = it->second;
                 event.set_end_reason(how);
                 event.set_scan(scan);
                 return draft;
               })
      .status();
}

}  // namespace vantage::session
