#include "counterpoint/model/pieces/part.h"

#include <algorithm>
#include <cmath>

#include "counterpoint/model/mesh/hull_distance.h"

namespace counterpoint::pieces {
namespace {

/// Heights of a triangle's corners over a plane; heights within the slack are zero.
struct Heights {
  std::array<double, 3> of;
  bool below = false, above = false;

  Heights(const Corners3& triangle, const CutPlane& plane, double slack) {
    for (int k = 0; k < 3; ++k) {
      const double height = plane.height(triangle[k]);
      of[k] = std::abs(height) <= slack ? 0.0 : height;
      below = below || of[k] < 0.0;
      above = above || of[k] > 0.0;
    }
  }
};

/// Side of a triangle in the plane: that on which the solid is.
int side_of_flat(const Corners3& t, const CutPlane& plane) {
  return (t[1] - t[0]).cross(t[2] - t[0]).dot(plane.normal) > 0.0 ? 0 : 1;
}

/// Cuts a triangle into a polygon of three or four corners on each side of the plane.
Sides clip(const Corners3& t, const Heights& heights) {
  Sides out;
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    const double h = heights.of[k], g = heights.of[next];
    if (h <= 0.0) out[0].push_back(t[k]);
    if (h >= 0.0) out[1].push_back(t[k]);
    if (h * g >= 0.0) continue;
    // From the lower end, so that two triangles at this edge get the same point.
    const Vector3 p = h < g ? Vector3(t[k] + h / (h - g) * (t[next] - t[k]))
                            : Vector3(t[next] + g / (g - h) * (t[k] - t[next]));
    out[0].push_back(p);
    out[1].push_back(p);
  }
  return out;
}

}  // namespace

std::vector<Vector3> Cell::section(const CutPlane& plane) const {
  std::vector<Vector3> out;
  for (const std::vector<Vector3>& face : faces) {
    for (std::size_t i = 0; i < face.size(); ++i) {
      const Vector3 &p = face[i], &q = face[(i + 1) % face.size()];
      const double h = plane.height(p), g = plane.height(q);
      if (h < 0.0 && g >= 0.0) out.push_back(p + h / (h - g) * (q - p));
    }
  }
  return out;
}

void Cell::cut(const CutPlane& plane) {
  std::vector<Vector3> lid = section(plane);
  std::vector<std::vector<Vector3>> kept;
  for (const std::vector<Vector3>& face : faces) {
    std::vector<Vector3> rest;
    for (std::size_t i = 0; i < face.size(); ++i) {
      const Vector3 &p = face[i], &q = face[(i + 1) % face.size()];
      const double h = plane.height(p), g = plane.height(q);
      if (h < 0.0) rest.push_back(p);
      if ((h < 0.0) != (g < 0.0)) rest.push_back(p + h / (h - g) * (q - p));
    }
    if (rest.size() >= 3) kept.push_back(std::move(rest));
  }
  faces = std::move(kept);
  if (lid.size() < 3) return;
  Vector3 middle = Vector3::Zero();
  for (const Vector3& p : lid) middle += p / static_cast<double>(lid.size());
  const Matrix3 frame = frame_from_normal(plane.normal);
  const auto angle = [&](const Vector3& p) {
    const Vector3 arm = frame.transpose() * (p - middle);
    return std::atan2(arm.y(), arm.x());
  };
  std::sort(lid.begin(), lid.end(),
            [&](const Vector3& p, const Vector3& q) { return angle(p) < angle(q); });
  faces.push_back(std::move(lid));
}

std::vector<Vector3> Cell::corners_inside(const WindingNumber& winding, double shift) const {
  std::vector<Vector3> all;
  Vector3 middle = Vector3::Zero();
  for (const std::vector<Vector3>& face : faces) {
    for (const Vector3& p : face) {
      const auto same = [&](const Vector3& q) { return (p - q).squaredNorm() < shift * shift; };
      if (std::any_of(all.begin(), all.end(), same)) continue;
      all.push_back(p);
      middle += p;
    }
  }
  middle /= static_cast<double>(std::max<std::size_t>(all.size(), 1));
  std::erase_if(all, [&](const Vector3& p) {
    return !winding.inside(p + shift * (middle - p).normalized());
  });
  return all;
}

std::vector<Vector3> Part::points() const {
  std::vector<Vector3> out = corners;
  for (const Corners3& t : triangles) out.insert(out.end(), t.begin(), t.end());
  return out;
}

Sides Part::points_beside(const CutPlane& plane, const Nearness& near, std::size_t stride,
                          const WindingNumber& winding, const ConvexMesh& hull) const {
  Sides out;
  for (std::size_t i = 0; i < triangles.size(); i += stride) {
    const Corners3& t = triangles[i];
    const Heights heights(t, plane, near.flat);
    if (heights.below && heights.above) {
      const Sides parts = clip(t, heights);
      for (int k = 0; k < 2; ++k) out[k].insert(out[k].end(), parts[k].begin(), parts[k].end());
      continue;
    }
    const int side = heights.below ? 0 : heights.above ? 1 : side_of_flat(t, plane);
    out[side].insert(out[side].end(), t.begin(), t.end());
  }
  for (const Vector3& p : corners) out[plane.height(p) < 0.0 ? 0 : 1].push_back(p);
  const std::vector<Vector3> lid = cell.section(plane);
  Vector3 middle = Vector3::Zero();
  for (const Vector3& p : lid) middle += p / static_cast<double>(lid.size());
  for (const Vector3& p : lid) {
    if (excess(hull, p) > near.shift) continue;
    const Vector3 inwards = (middle - p).normalized();
    for (int k = 0; k < 2; ++k) {
      const Vector3 way = inwards + (k == 0 ? -1.0 : 1.0) * plane.normal;
      if (winding.inside(p + near.shift * way)) out[k].push_back(p);
    }
  }
  return out;
}

std::array<Part, 2> Part::split(const CutPlane& plane, const Nearness& near,
                                const WindingNumber& winding, const ConvexMesh& hull) const {
  std::array<Part, 2> out;
  for (const Corners3& t : triangles) {
    const Heights heights(t, plane, near.flat);
    if (heights.below && heights.above) {
      const Sides parts = clip(t, heights);
      for (int side = 0; side < 2; ++side)
        for (std::size_t i = 2; i < parts[side].size(); ++i)
          out[side].triangles.push_back({parts[side][0], parts[side][i - 1], parts[side][i]});
      continue;
    }
    const int side = heights.below ? 0 : heights.above ? 1 : side_of_flat(t, plane);
    out[side].triangles.push_back(t);
  }
  for (int side = 0; side < 2; ++side) {
    const CutPlane outward = side == 0 ? plane : CutPlane{Vector3(-plane.normal), -plane.offset};
    out[side].planes = planes;
    out[side].planes.push_back(outward);
    out[side].cell = cell;
    out[side].cell.cut(outward);
    out[side].corners = out[side].cell.corners_inside(winding, near.shift);
    std::erase_if(out[side].corners,
                  [&](const Vector3& p) { return excess(hull, p) > near.shift; });
  }
  return out;
}

}  // namespace counterpoint::pieces
