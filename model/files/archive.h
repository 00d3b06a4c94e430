// Binary archives: numbers, lists and meshes written and read to the bit. Private to the model.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "counterpoint/model/geometry.h"
#include "counterpoint/model/spatial.h"

namespace counterpoint::archive {

template <class T>
concept Plain = std::is_arithmetic_v<T> || std::is_enum_v<T>;

/// Objects shared by several parts, in the order of their first occurrence.
template <class T>
using Shared = std::vector<std::shared_ptr<const T>>;

/// Writer and Reader are the two directions of an archive; visit() functions in this namespace list
/// the content of each type once for both.
class Writer {
 public:
  static constexpr bool kReads = false;
  template <class... T>
  void operator()(T&... parts);
  template <Plain T>
  void plain(T& x) {
    bytes.append(reinterpret_cast<const char*>(&x), sizeof x);
  }
  void size(std::uint64_t& n) { plain(n); }
  template <class T>
  void shared(std::shared_ptr<const T>& pointer, Shared<T>& known);

  std::string bytes;
  Shared<ConvexMesh> meshes;
  Shared<Terrain> terrains;
};

class Reader {
 public:
  static constexpr bool kReads = true;
  /// `what` begins the messages of errors, as "scene archive".
  Reader(std::string_view all, const char* what) : bytes(all), what_(what) {}
  template <class... T>
  void operator()(T&... parts);
  template <Plain T>
  void plain(T& x) {
    if (bytes.size() < sizeof x) throw InputError(std::string(what_) + ": cut short");
    std::memcpy(&x, bytes.data(), sizeof x);
    bytes.remove_prefix(sizeof x);
  }
  /// Reads the size of a list. Every element takes at least one byte, so a damaged size cannot
  /// exhaust memory.
  void size(std::uint64_t& n) {
    plain(n);
    if (n > bytes.size())
      throw InputError(std::string(what_) + ": damaged, a list is longer than the rest");
  }
  template <class T>
  void shared(std::shared_ptr<const T>& pointer, Shared<T>& known);

  std::string_view bytes;
  Shared<ConvexMesh> meshes;
  Shared<Terrain> terrains;

 private:
  const char* what_;
};

template <class A, Plain T>
void visit(A& a, T& x) {
  a.plain(x);
}
template <class A, class T, int R, int C, int O, int MR, int MC>
void visit(A& a, Eigen::Matrix<T, R, C, O, MR, MC>& m) {
  if constexpr (R == Eigen::Dynamic) {
    auto n = static_cast<std::uint64_t>(m.rows());
    a.size(n);
    m.resize(static_cast<Eigen::Index>(n), 1);
  }
  for (Eigen::Index i = 0; i < m.size(); ++i) a.plain(m.data()[i]);
}
template <class A>
void visit(A& a, std::string& s) {
  std::uint64_t n = s.size();
  a.size(n);
  s.resize(n);
  for (char& c : s) a.plain(c);
}
template <class A, class T>
void visit(A& a, std::vector<T>& list) {
  std::uint64_t n = list.size();
  a.size(n);
  list.resize(n);
  for (T& x : list) a(x);
}
template <class A, class T, std::size_t N>
void visit(A& a, std::array<T, N>& list) {
  for (T& x : list) a(x);
}
template <class A, class T, class U>
void visit(A& a, std::pair<T, U>& x) {
  a(x.first, x.second);
}
template <class A, class T>
void visit(A& a, std::optional<T>& x) {
  bool there = x.has_value();
  a.plain(there);
  if constexpr (A::kReads) {
    if (there) x.emplace();
  }
  if (there) a(*x);
}
// Structures are visited through structured bindings of all their members: after adding a member
// the code does not compile until it is listed here.
template <class A>
void visit(A& a, VertexNeighbors::Neighbor& x) {
  auto& [place, vertex] = x;
  a(place, vertex);
}
template <class A>
void visit(A& a, VertexNeighbors& x) {
  auto& [begin, all] = x;
  a(begin, all);
}
template <class A>
void visit(A& a, ConvexMesh& x) {
  auto& [vertices, faces, normals, offsets, neighbors, vertex_faces, vertex_columns, normal_columns,
         interior, radius, volume, source_volume, standoff, deviation, source, pieces,
         union_standoff, hull_reason] = x;
  static_cast<void>(pieces);  // a model has them as geometries
  a(vertices, faces, normals, offsets, neighbors, vertex_faces, vertex_columns, normal_columns,
    interior, radius, volume, source_volume, standoff, deviation, source, union_standoff,
    hull_reason);
}
template <class... T>
void Writer::operator()(T&... parts) {
  (visit(*this, parts), ...);
}
template <class... T>
void Reader::operator()(T&... parts) {
  (visit(*this, parts), ...);
}

/// Writes the index of a shared object in `known`, followed by the object at its first occurrence;
/// -1 for null.
template <class T>
void Writer::shared(std::shared_ptr<const T>& pointer, Shared<T>& known) {
  int index = -1;
  if (pointer) {
    index = static_cast<int>(std::find(known.begin(), known.end(), pointer) - known.begin());
  }
  plain(index);
  if (index < static_cast<int>(known.size())) return;
  known.push_back(pointer);
  visit(*this, const_cast<T&>(*pointer));  // Writer only reads the object
}
template <class T>
void Reader::shared(std::shared_ptr<const T>& pointer, Shared<T>& known) {
  int index = 0;
  plain(index);
  if (index < 0) return;
  if (index > static_cast<int>(known.size()))
    throw InputError(std::string(what_) + ": damaged, no such mesh");
  if (index == static_cast<int>(known.size())) {
    auto made = std::make_shared<T>();
    visit(*this, *made);
    known.push_back(made);
  }
  pointer = known[static_cast<size_t>(index)];
}

}  // namespace counterpoint::archive
