// Robots and scenes in files, read and written: URDF, MJCF, meshes, height fields, scenes as bytes.
#pragma once

#include "counterpoint/model/export/export.h"
#include "counterpoint/model/mesh/mesh.h"
#include "counterpoint/model/mjcf/mjcf.h"
#include "counterpoint/model/scene/scene_archive.h"
#include "counterpoint/model/terrain/height_field.h"
#include "counterpoint/model/terrain/terrain.h"
#include "counterpoint/model/urdf/mesh_path.h"
#include "counterpoint/model/urdf/urdf.h"
