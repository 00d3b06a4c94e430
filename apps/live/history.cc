#include "live/history.h"

namespace counterpoint::live {

size_t bytes_of(const State& state) {
  return sizeof state +
         sizeof(double) * static_cast<size_t>(state.q.size() + state.v.size() + state.z.size()) +
         sizeof(RememberedForce) * state.memory.size();
}

void History::add(const State& state) {
  states_.push_back(state);
  bytes_ += bytes_of(state);
  while (states_.size() > kMost || (bytes_ > kMostBytes && states_.size() > 2)) {
    bytes_ -= bytes_of(states_.front());
    states_.pop_front();
  }
}

const State* History::rewind(double time) {
  while (states_.size() > 1 && states_.back().time > time) {
    bytes_ -= bytes_of(states_.back());
    states_.pop_back();
  }
  return states_.empty() ? nullptr : &states_.back();
}

void History::clear() {
  states_.clear();
  bytes_ = 0;
}

}  // namespace counterpoint::live
