#include "counterpoint/engine/state.h"

namespace counterpoint {

std::uint64_t state_hash(const State& state) {
  Hash hash;
  hash.add(state.time);
  hash.add(state.q);
  hash.add(state.v);
  hash.add(state.z);
  return hash.value();
}

}  // namespace counterpoint
