# `cpack --config build/release/CPackConfig.cmake` writes five Debian packages: counterpoint (command,
# data, manual page, completion), libcounterpoint0.1 (what programs load while they run),
# libcounterpoint-dev, python3-counterpoint, counterpoint-doc.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME counterpoint)
set(CPACK_PACKAGE_VENDOR "Counterpoint")
set(CPACK_PACKAGE_CONTACT "Counterpoint developers <counterpoint@example.org>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
# Modes, changelog and licence of a package as Debian's policy wants them.
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ
    GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PRE_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/cmake/debian/documents.cmake)

# counterpoint_package(COMPONENT PACKAGE SECTION HAS [DEPENDS components]): HAS is what the package has.
function(counterpoint_package component package section has)
  cmake_parse_arguments(ARG "" "" "DEPENDS" ${ARGN})
  string(TOUPPER ${component} key)
  set(CPACK_DEBIAN_${key}_PACKAGE_NAME ${package} PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_PACKAGE_SECTION ${section} PARENT_SCOPE)
  set(CPACK_DEBIAN_${key}_DESCRIPTION "Counterpoint simulates rigid bodies, recovers the forces behind a motion,
and has exact derivatives of both.\n.\nThis package has ${has}." PARENT_SCOPE)
  set(CPACK_COMPONENT_${key}_DEPENDS ${ARG_DEPENDS} PARENT_SCOPE)
  set(CPACK_COMPONENTS_ALL ${CPACK_COMPONENTS_ALL} ${component} PARENT_SCOPE)
endfunction()
set(interface ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
counterpoint_package(library libcounterpoint${interface} libs
  "the viewer, and the readers that programs load while they run")
counterpoint_package(command counterpoint science "the command and the bundled scenes" DEPENDS library)
counterpoint_package(development libcounterpoint-dev libdevel
  "headers, static libraries and the files for CMake" DEPENDS library)
counterpoint_package(documents counterpoint-doc doc "the guide, the reference and examples in C++ and Python")
# The viewer is a shared library in the loader's path.
configure_file(${PROJECT_SOURCE_DIR}/cmake/debian/shlibs.in ${PROJECT_BINARY_DIR}/debian/shlibs @ONLY)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA
    ${PROJECT_SOURCE_DIR}/cmake/debian/triggers ${PROJECT_BINARY_DIR}/debian/shlibs)
set(CPACK_DEBIAN_COMMAND_PACKAGE_SUGGESTS "chromium, counterpoint-doc")
set(CPACK_DEBIAN_DOCUMENTS_PACKAGE_ARCHITECTURE all)
# Dependencies found by counterpointConfig.cmake, beside the package of the shared parts.
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
    "libeigen3-dev, libfmt-dev, liburdfdom-dev, liburdfdom-headers-dev, zlib1g-dev, libyaml-cpp-dev, libtinyxml2-dev, libqhull-dev, libmeshoptimizer-dev, libsleef-dev, libpng-dev, libconsole-bridge-dev")
if(TARGET counterpoint_python)
  counterpoint_package(python python3-counterpoint python "the Python module" DEPENDS library)
  math(EXPR after "${COUNTERPOINT_PYTHON_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
      "python3 (>= 3.${COUNTERPOINT_PYTHON_MINOR}~), python3 (<< 3.${after}~), python3-numpy")
endif()
include(CPack)
