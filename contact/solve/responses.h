// Responses of the velocities to impulses at single constraints, found on first use.
#pragma once

#include <vector>

#include "counterpoint/contact/solve/island_system.h"

namespace counterpoint::contact {

class Responses {
 public:
  /// Reserves the most memory that an island can need.
  void reserve(const IslandSystem& system);
  /// Takes an island and forgets earlier responses. The system must outlive its use here. False if
  /// M is not positive definite.
  bool begin(const IslandSystem& system);
  /// Computes w = w* + inv(M) J' f.
  void velocity(const double* f, double* w);
  /// Returns whether the response to this constraint has been found.
  bool knows(int constraint) const { return known_[constraint].num_parts >= 0; }
  /// Returns J_c inv(M) J_c', rows x rows [1/kg].
  const double* own(int constraint);
  /// Computes w += inv(M) J_c' f_c.
  void add(int constraint, const double* f, double* w);

 private:
  /// inv(M) J_c' in one velocity block: rows x size values, row-major.
  struct Part {
    int velocity, size, first_value;
  };
  /// Response to a constraint; num_parts < 0 if it is not known.
  struct Known {
    int first_part = 0, num_parts = -1, own = 0;
  };
  void find(int constraint);
  int find_part(int constraint, int first, int end, int column);

  const IslandSystem* system_ = nullptr;
  std::vector<int> first_factor_;  ///< for each velocity block
  std::vector<Known> known_;
  std::vector<Part> parts_;
  std::vector<double> factors_, values_, scratch_;
};

}  // namespace counterpoint::contact
