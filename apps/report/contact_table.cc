#include "contact_table.h"

namespace counterpoint::apps {

ContactTable::ContactTable(const std::string& file, const Model& model)
    : model_(model),
      writer_(file, {"time", "geometry_a", "geometry_b", "x", "y", "z", "nx", "ny", "nz", "gap",
                     "fx", "fy", "fz", "slip_x", "slip_y", "slip_z"}) {}

void ContactTable::add_step(double time, const Inverse& forces) {
  for (const ContactForce& contact : forces.contacts) {
    const collision::Candidate& where = contact.contact;
    writer_.number(time);
    writer_.text(model_.geometries()[where.geometry_a].name);
    writer_.text(model_.geometries()[where.geometry_b].name);
    for (const double x : where.position) writer_.number(x);
    for (const double x : where.normal) writer_.number(x);
    writer_.number(where.gap);
    for (const double x : contact.force) writer_.number(x);
    for (const double x : contact.slip) writer_.number(x);
    writer_.end_row();
  }
}

}  // namespace counterpoint::apps
