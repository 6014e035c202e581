// Registrations, instruments and frames in words.
#ifndef VANTAGE_SERVER_REPORT_OUTCOME_WORDS_H_
#define VANTAGE_SERVER_REPORT_OUTCOME_WORDS_H_

#include <string>

#include "server/report/job_record.h"
#include "server/report/words.h"

namespace vantage::report {

// Why a scan did not register by itself, as far as its last alignment says.
std::string ReasonWords(const v1::Scan& scan, const Words& say);

// How a scan got its pose: 'registered by the shape of what it sees, ...'.
std::string PoseSourceWords(const v1::Scan& scan, const Words& say);

// 'leica-rtc360 at 6mm', or the id of a scanner without a preset.
std::string InstrumentTitle(const v1::ScannerModel& scanner, const Words& say);

// Which frame the coordinates are in.
std::string FrameWords(const JobRecord& job, const Words& say);

}  // namespace vantage::report

#endif  // VANTAGE_SERVER_REPORT_OUTCOME_WORDS_H_
