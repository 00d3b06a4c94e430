// What velocities answer to impulses at single constraints, found when it is first asked for.
#pragma once

#include <vector>

#include "counterpoint/contact/solve/island_system.h"

namespace counterpoint::contact {

class Responses {
 public:
  /// Takes the memory that an island needs at most.
  void reserve(const IslandSystem& system);
  /// Forgets what it knew. The system must outlive its use here. False if M is not positive
  /// definite.
  bool begin(const IslandSystem& system);
  /// w = w* + inv(M) J' f.
  void velocity(const double* f, double* w);
  /// Whether own() or add() have asked for this constraint's before.
  bool knows(int constraint) const { return known_[constraint].num_parts >= 0; }
  /// J_c inv(M) J_c', rows x rows [1/kg].
  const double* own(int constraint);
  /// w += inv(M) J_c' f_c.
  void add(int constraint, const double* f, double* w);

 private:
  /// inv(M) J_c' in one velocity block: `rows` times `size` values.
  struct Part {
    int velocity, size, first_value;
  };
  /// Of a constraint: num_parts < 0 where nothing is known.
  struct Known {
    int first_part = 0, num_parts = -1, own = 0;
  };
  void find(int constraint);
  int find_part(int constraint, int first, int end, int column);

  const IslandSystem* system_ = nullptr;
  std::vector<int> first_factor_;  ///< by block
  std::vector<Known> known_;
  std::vector<Part> parts_;
  std::vector<double> factors_, values_, scratch_;
};

}  // namespace counterpoint::contact
