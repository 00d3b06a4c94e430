#include "contact_table.h"

namespace counterpoint::apps {

namespace {

std::vector<Column> contact_columns(const Model& model) {
  std::vector<std::string> names;
  for (const Geometry& geometry : model.geometries()) names.push_back(geometry.name);
  return {"time",
          {"geometry_a", CellType::kLabel, names},
          {"geometry_b", CellType::kLabel, names},
          "x",
          "y",
          "z",
          "nx",
          "ny",
          "nz",
          "gap",
          "fx",
          "fy",
          "fz",
          "slip_x",
          "slip_y",
          "slip_z"};
}

}  // namespace

ContactTable::ContactTable(const std::string& file, const Model& model)
    : writer_(file, contact_columns(model)) {}

void ContactTable::add_step(double time, const Inverse& forces) {
  for (const ContactForce& contact : forces.contacts) {
    const collision::Candidate& where = contact.contact;
    writer_.number(time);
    writer_.label(where.geometry_a);
    writer_.label(where.geometry_b);
    for (const double x : where.position) writer_.number(x);
    for (const double x : where.normal) writer_.number(x);
    writer_.number(where.gap);
    for (const double x : contact.force) writer_.number(x);
    for (const double x : contact.slip) writer_.number(x);
    writer_.end_row();
  }
}

}  // namespace counterpoint::apps
