// A table with aligned columns.
#ifndef VANTAGE_CLIENT_CLI_TABLE_H_
#define VANTAGE_CLIENT_CLI_TABLE_H_

#include <string>
#include <vector>

namespace vantage::cli {

class Table {
 public:
  // A header that starts with '>' is a column of figures, aligned right.
  explicit Table(std::vector<std::string> headers);

  // As many cells as there are columns.
  void Add(std::vector<std::string> cells);

  // Lines with their line ends; no trailing blanks.
  std::string ToString() const;

 private:
  std::vector<bool> right_;
  std::vector<std::vector<std::string>> rows_;  // the first holds the headers
};

// Characters, not bytes: what a UTF-8 string takes up on a terminal (no wide characters).
size_t DisplayWidth(const std::string& text);

// Fills up with blanks to the width; longer text stays as it is.
std::string PadLeft(const std::string& text, size_t width);
std::string PadRight(const std::string& text, size_t width);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_TABLE_H_
