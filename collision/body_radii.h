// How far bodies reach.
#pragma once

#include <vector>

#include "counterpoint/model/model.h"

namespace counterpoint::collision {

/// Of the smallest ball about the shape's origin that holds it [m]; 0 of planes and terrain.
double bounding_radius(const Shape& shape);

/// By body, the world first: of a ball about the body's origin that holds all its shapes [m]; 0 without shapes.
std::vector<double> body_radii(const Model& model);

}  // namespace counterpoint::collision
