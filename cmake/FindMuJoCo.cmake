# Finds MuJoCo by its header and library. Its own package file requires OpenGL's, which
# libmujoco-dev does not install, so that find_package(mujoco CONFIG) fails without it; another
# MuJoCo is found through CMAKE_PREFIX_PATH or MUJOCO_ROOT (the unpacked archive of its release).
# Sets MuJoCo_FOUND and MuJoCo_VERSION; defines mujoco::mujoco.
find_path(MuJoCo_INCLUDE_DIR mujoco/mujoco.h HINTS ${MUJOCO_ROOT} ENV MUJOCO_ROOT PATH_SUFFIXES include)
find_library(MuJoCo_LIBRARY mujoco HINTS ${MUJOCO_ROOT} ENV MUJOCO_ROOT PATH_SUFFIXES lib)
if(MuJoCo_INCLUDE_DIR)
  # mjVERSION_HEADER 222 means 2.2.2; later versions use the form 3012001.
  file(STRINGS ${MuJoCo_INCLUDE_DIR}/mujoco/mujoco.h line REGEX "define mjVERSION_HEADER +[0-9]+")
  string(REGEX REPLACE ".*mjVERSION_HEADER +([0-9]+).*" "\\1" number "${line}")
  if(number GREATER 999999)
    math(EXPR major "${number} / 1000000")
    math(EXPR minor "${number} / 1000 % 1000")
    math(EXPR patch "${number} % 1000")
  else()
    math(EXPR major "${number} / 100")
    math(EXPR minor "${number} / 10 % 10")
    math(EXPR patch "${number} % 10")
  endif()
  set(MuJoCo_VERSION ${major}.${minor}.${patch})
endif()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(MuJoCo REQUIRED_VARS MuJoCo_LIBRARY MuJoCo_INCLUDE_DIR
                                  VERSION_VAR MuJoCo_VERSION)
if(MuJoCo_FOUND AND NOT TARGET mujoco::mujoco)
  add_library(mujoco::mujoco UNKNOWN IMPORTED)
  set_target_properties(mujoco::mujoco PROPERTIES IMPORTED_LOCATION ${MuJoCo_LIBRARY}
                                                  INTERFACE_INCLUDE_DIRECTORIES ${MuJoCo_INCLUDE_DIR})
endif()
mark_as_advanced(MuJoCo_INCLUDE_DIR MuJoCo_LIBRARY)
