#ifndef VANTAGE_CLIENT_STUDY_MEDIAN_H_
#define VANTAGE_CLIENT_STUDY_MEDIAN_H_

#include <vector>

namespace vantage::study {

// The median of an odd or even number of values; 0 for none.
double Median(std::vector<double> values);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_MEDIAN_H_
