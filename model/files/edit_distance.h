// Edit distance of two names, to suggest the nearest one.
#pragma once

#include <algorithm>
#include <numeric>
#include <string>
#include <vector>

namespace counterpoint {

/// Letters to be put in, taken out or changed to make one word of the other (Levenshtein).
inline int edit_distance(const std::string& a, const std::string& b) {
  std::vector<int> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (const char letter : a) {
    int diagonal = row[0]++;
    for (size_t j = 0; j < b.size(); ++j) {
      const int changed = diagonal + (letter == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({changed, row[j] + 1, diagonal + 1});
    }
  }
  return row.back();
}

}  // namespace counterpoint
