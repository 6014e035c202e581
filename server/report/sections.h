// The parts of a report, in the order in which they come.
#ifndef VANTAGE_SERVER_REPORT_SECTIONS_H_
#define VANTAGE_SERVER_REPORT_SECTIONS_H_

#include <vector>

#include "server/report/html.h"
#include "server/report/job_record.h"
#include "server/report/requirements.h"
#include "server/report/storeys.h"
#include "server/report/words.h"

namespace vantage::report {

// The document up to its first section, and its end.
Html WriteHead(const JobRecord& job, const Words& say);
Html WriteEnd();

// What was required and what was reached, and where somebody signs.
Html WriteSignOff(const JobRecord& job, const Standing& standing, const Words& say);

// The plan of one storey, to scale; `first`: the chapter's heading goes before it.
Html WriteFloorPlan(const JobRecord& job, const std::vector<ReportStorey>& storeys, size_t storey,
                    bool first, const Words& say);

// Poses, how well they are known, and what ties them to each other.
Html WriteStations(const JobRecord& job, const Standing& standing, const Words& say);

// What is missing, why, and where.
Html WriteRemaining(const JobRecord& job, const Standing& standing, const Words& say);

// What plans promised of each scan, and what it brought.
Html WritePromises(const JobRecord& job, const Words& say);

Html WriteInstruments(const JobRecord& job, const Words& say);

// What was moved at the site while it was scanned.
Html WriteChanges(const JobRecord& job, const Words& say);

Html WriteDecisions(const JobRecord& job, const Words& say);

}  // namespace vantage::report

#endif  // VANTAGE_SERVER_REPORT_SECTIONS_H_
