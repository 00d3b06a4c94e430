# All libraries of the project are created here, so that flags and the Eigen ABI are set in one
# place.

# "#include <counterpoint/model/model.h>" must work in the build tree and after installation: the
# build tree has a link of that name to the sources.
file(MAKE_DIRECTORY ${PROJECT_BINARY_DIR}/include)
file(REAL_PATH ${CMAKE_CURRENT_LIST_DIR}/.. counterpoint_root)
file(CREATE_LINK ${counterpoint_root} ${PROJECT_BINARY_DIR}/include/counterpoint SYMBOLIC)

# Targets with the property COUNTERPOINT_PUBLIC_HEADERS_ONLY (the apps) can include installed
# headers only: a folder of links to the headers in cmake/public_headers.txt.
set(public_headers_list ${CMAKE_CURRENT_LIST_DIR}/public_headers.txt)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${public_headers_list})
file(STRINGS ${public_headers_list} COUNTERPOINT_PUBLIC_HEADERS REGEX "\\.h$")
file(REMOVE_RECURSE ${PROJECT_BINARY_DIR}/public_include)
foreach(header ${COUNTERPOINT_PUBLIC_HEADERS})
  get_filename_component(folder ${PROJECT_BINARY_DIR}/public_include/counterpoint/${header} DIRECTORY)
  file(MAKE_DIRECTORY ${folder})
  file(CREATE_LINK ${counterpoint_root}/${header} ${PROJECT_BINARY_DIR}/public_include/counterpoint/${header} SYMBOLIC)
endforeach()
define_property(TARGET PROPERTY COUNTERPOINT_PUBLIC_HEADERS_ONLY
                INITIALIZE_FROM_VARIABLE DEFAULT_COUNTERPOINT_PUBLIC_HEADERS_ONLY)

option(COUNTERPOINT_UNITY "Compile 24 files of a target at a time: all is built sooner, an edit later" OFF)
set(COUNTERPOINT_UNITY_BATCH 24 CACHE STRING "Files of a target that COUNTERPOINT_UNITY compiles at a time")
add_library(counterpoint_flags INTERFACE)
target_compile_options(counterpoint_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>
  # Contraction would let the compiler choose between a*b+c and fma(a,b,c) at each call site and so
  # change the bits of results (native builds: counterpoint_fused); NaN and signed zero keep their
  # meaning. No code reads errno after a square root.
  -ffp-contract=off -fno-math-errno)
if(COUNTERPOINT_UNITY)
  # In unity builds GCC warns about a class with members of anonymous-namespace types, as if it were
  # in a header.
  target_compile_options(counterpoint_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endif()
# The elementary functions of model/math, with the same bits on every processor. contact/ alone,
# which depends on Eigen only, uses those of the C library.
if(COUNTERPOINT_PORTABLE_MATH)
  find_library(SLEEF_LIBRARY sleef REQUIRED)
  target_compile_options(counterpoint_flags INTERFACE
    "SHELL:-include ${counterpoint_root}/model/math/portable_math.h")
  target_link_libraries(counterpoint_flags INTERFACE counterpoint_math)
endif()
if(COUNTERPOINT_WERROR)
  target_compile_options(counterpoint_flags INTERFACE -Werror)
endif()
if(COUNTERPOINT_NATIVE)
  # GCC 12 mistakes guarded AVX-512 loads of short vectors in Eigen for reads past the end.
  target_compile_options(counterpoint_flags INTERFACE -march=native
    $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds -Wno-stringop-overread>)
endif()

# Compiles a target in batches of 24 files. Test files share names such as kRoundoff, so each has a
# namespace named after the file.
function(counterpoint_unity target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${COUNTERPOINT_UNITY} UNITY_BUILD_BATCH_SIZE ${COUNTERPOINT_UNITY_BATCH})
endfunction()

# Lets native builds contract products and sums in the sources of a library, except those that match
# `except` (docs/decisions/build.md). Call it from the directory of the target.
function(counterpoint_fused target except)
  if(NOT COUNTERPOINT_NATIVE)
    return()
  endif()
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources EXCLUDE REGEX "${except}")
  set_source_files_properties(${sources} PROPERTIES COMPILE_OPTIONS "-ffp-contract=fast")
endfunction()

# counterpoint_library(NAME SOURCES ... [PUBLIC libs] [PRIVATE libs])
function(counterpoint_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  set(target counterpoint_${name})
  add_library(${target} ${ARG_SOURCES})
  add_library(counterpoint::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  target_include_directories(${target} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/$<IF:$<BOOL:$<TARGET_PROPERTY:COUNTERPOINT_PUBLIC_HEADERS_ONLY>>,public_include,include>>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  # Debian's libfcl is built without AVX, so its fixed-size Eigen types are aligned to 16 bytes. All
  # code that shares Eigen types with it or with this library must use the same alignment, whatever
  # -m flags are used. The second definition makes dynamic memory plain malloc and free too:
  # otherwise an AVX translation unit frees memory of another one by Eigen's own aligned scheme and
  # crashes.
  target_compile_definitions(${target} PUBLIC EIGEN_MAX_ALIGN_BYTES=16
                                              EIGEN_MALLOC_ALREADY_ALIGNED=1)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_link_libraries(${target} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE}
                        $<BUILD_INTERFACE:counterpoint_flags>)
  if(COUNTERPOINT_PORTABLE_MATH AND NOT name STREQUAL math)
    target_link_libraries(${target} PRIVATE counterpoint_math)
  endif()
  counterpoint_unity(${target})
  counterpoint_precompile(${target})
  set_property(GLOBAL APPEND PROPERTY COUNTERPOINT_LIBRARIES ${target})
endfunction()

# Precompiles headers that nearly every file of a target includes. GCC's option lets ccache handle
# them. Unity builds parse them only a few times and do without.
option(COUNTERPOINT_PRECOMPILED_HEADERS "Precompile Eigen, the standard library, CLI11, JSON" ON)
function(counterpoint_precompile target)
  get_target_property(unity ${target} UNITY_BUILD)
  if(unity OR NOT COUNTERPOINT_PRECOMPILED_HEADERS)
    return()
  endif()
  target_precompile_headers(${target} PRIVATE ${ARGN}
    <algorithm> <array> <cmath> <filesystem> <map> <optional> <span> <string> <vector> <Eigen/Core> <Eigen/Geometry>)
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>)
endfunction()

# counterpoint_module(NAME SOURCES ... PRIVATE libs): part of the program in a shared library of its
# own, opened when it is first needed (model/files/module.h). The last source defines
# COUNTERPOINT_MODULE, its table of functions.
string(REPLACE "." "_" COUNTERPOINT_MODULE_VERSION ${PROJECT_VERSION})
set(COUNTERPOINT_MODULE_FOLDER ${PROJECT_BINARY_DIR}/lib)
list(APPEND CMAKE_BUILD_RPATH ${COUNTERPOINT_MODULE_FOLDER})
# The sanitizer's library opens the modules for the program, whose folders it sees only as RPATH.
if("${CMAKE_CXX_FLAGS}" MATCHES "-fsanitize")
  add_link_options(-Wl,--disable-new-dtags)
endif()
function(counterpoint_module name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PRIVATE" ${ARGN})
  set(target counterpoint_${name})
  add_library(${target} MODULE ${ARG_SOURCES})
  target_link_libraries(${target} PRIVATE ${ARG_PRIVATE} counterpoint_flags)
  # Links the called libraries only, and exports the table of functions alone.
  target_link_options(${target} PRIVATE -Wl,--as-needed -Wl,--exclude-libs,ALL)
  set_target_properties(${target} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${COUNTERPOINT_MODULE_FOLDER} CXX_VISIBILITY_PRESET hidden)
  list(GET ARG_SOURCES -1 table)
  set_property(SOURCE ${table} APPEND PROPERTY COMPILE_DEFINITIONS COUNTERPOINT_MODULE=${target}_${COUNTERPOINT_MODULE_VERSION})
  counterpoint_unity(${target})
  counterpoint_precompile(${target})
  set_property(GLOBAL APPEND PROPERTY COUNTERPOINT_MODULES ${target})
endfunction()
