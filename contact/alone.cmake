# Makes contact/ a project of its own, with the compiler flags of the whole project.
project(counterpoint_contact VERSION 0.1.0 LANGUAGES CXX
        DESCRIPTION "Convex, smooth, invertible contact: laws and solver")
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
if(NOT CMAKE_BUILD_TYPE AND NOT CMAKE_CONFIGURATION_TYPES)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
endif()
option(COUNTERPOINT_BUILD_TESTS "Build the tests" ON)
option(COUNTERPOINT_NATIVE "Compile for this machine's processor (-march=native)" OFF)
option(COUNTERPOINT_WERROR "Treat warnings as errors" OFF)
include(GNUInstallDirs)
include(${CMAKE_CURRENT_SOURCE_DIR}/../cmake/CounterpointTargets.cmake)
