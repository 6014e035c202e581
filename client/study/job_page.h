// One simulated job as one HTML page, with its pictures beside it.
#ifndef VANTAGE_CLIENT_STUDY_JOB_PAGE_H_
#define VANTAGE_CLIENT_STUDY_JOB_PAGE_H_

#include <optional>
#include <string>
#include <vector>

namespace vantage::study {

struct JobPage {
  struct Scan {
    int number = 0;        // from 1
    std::string position;  // for people
    std::string aligned;   // its verdict, for people
    double minutes = 0;    // on site, when it was done
    double attained = 0;   // share of what can be attained that is at density by now, the truth
    std::optional<double> estimated;  // the planner's estimate of its coverage
    std::string picture;              // file beside the page; empty: none
  };

  std::string title;
  std::vector<std::string> facts;  // what was reached and how; a paragraph each
  std::vector<Scan> scans;
  std::vector<double> oracle;  // attained after 1, 2, ... scans of who knows the scene
  std::string oracle_words;    // what that is; shown where there is a curve of it
  std::string link;            // to the page for tablets; empty: none
};

// Needs nothing but the pictures.
std::string Html(const JobPage& page);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_JOB_PAGE_H_
