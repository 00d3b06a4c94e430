// Number of rows of a constraint as a compile-time constant.
#pragma once

#include "counterpoint/contact/lanes/wide.h"

namespace counterpoint::contact {

template <int N>
struct RowCount {};

/// Calls visit(RowCount<rows>()) if rows is 1 ... 6: a constant, so that loops are unrolled.
template <class Visit>
COUNTERPOINT_INTO_EACH void with_rows(int rows, Visit visit) {
  switch (rows) {
    case 1:
      return visit(RowCount<1>());
    case 2:
      return visit(RowCount<2>());
    case 3:
      return visit(RowCount<3>());
    case 4:
      return visit(RowCount<4>());
    case 5:
      return visit(RowCount<5>());
    case 6:
      return visit(RowCount<6>());
    default:
      return;
  }
}

}  // namespace counterpoint::contact
