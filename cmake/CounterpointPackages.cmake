# `cpack --config build/release/CPackConfig.cmake` writes three Debian packages: counterpoint
# (command, data, manual page, completion), libcounterpoint-dev, python3-counterpoint. Each can be
# installed alone.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME counterpoint)
set(CPACK_PACKAGE_VENDOR "Counterpoint")
set(CPACK_PACKAGE_CONTACT "Counterpoint <counterpoint@localhost>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL command development)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)

set(CPACK_DEBIAN_COMMAND_PACKAGE_NAME counterpoint)
set(CPACK_COMPONENT_COMMAND_DESCRIPTION
    "Rigid-body physics with convex, smooth, invertible contact: command and scenes")
set(CPACK_DEBIAN_COMMAND_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_COMMAND_PACKAGE_SUGGESTS chromium)

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libcounterpoint-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
    "Rigid-body physics with convex, smooth, invertible contact: headers and libraries")
# Dependencies found by counterpointConfig.cmake, beside those of the modules.
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
    "libeigen3-dev, libfmt-dev, liburdfdom-dev, liburdfdom-headers-dev, zlib1g-dev, libyaml-cpp-dev, libtinyxml2-dev, libqhull-dev, libmeshoptimizer-dev, libsleef-dev, libpng-dev, libconsole-bridge-dev")

if(TARGET counterpoint_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-counterpoint)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION
      "Rigid-body physics with convex, smooth, invertible contact: Python module")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= 3.9), python3-numpy")
endif()
include(CPack)
