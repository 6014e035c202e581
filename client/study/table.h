// The jobs of a study in rows and figures.
#ifndef VANTAGE_CLIENT_STUDY_TABLE_H_
#define VANTAGE_CLIENT_STUDY_TABLE_H_

#include <string>
#include <vector>

#include "vantage/study_records/v1/study.pb.h"

namespace vantage::study {

// Scans until `goal` (share of the attainable surface), lost ones counted; where the job never got
// there most_scans + 1, the least that it would have needed.
int ScansUntil(const study_records::v1::JobRecord& record, double goal, int most_scans);

// Mean coverage after scans 1 to most_scans; a job that ended earlier stays where it was.
double AreaUnderCurve(const study_records::v1::JobRecord& record, int most_scans);

// `records` in the order of the study; `most_scans` by scene is StudySettings::For.
study_records::v1::Table MakeTable(const std::vector<study_records::v1::JobRecord>& records,
                                   double goal, const std::vector<int>& most_scans,
                                   const std::string& settings);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_TABLE_H_
