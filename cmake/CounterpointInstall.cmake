# Installation: libraries, public headers (under include/counterpoint/<folder>), the command, and
# the package files for find_package(counterpoint). Components: library (what programs load while
# they run), development, command, python, documents.
include(CMakePackageConfigHelpers)
get_property(libraries GLOBAL PROPERTY COUNTERPOINT_LIBRARIES)
install(TARGETS ${libraries} EXPORT counterpointTargets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development)
foreach(header ${COUNTERPOINT_PUBLIC_HEADERS})
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES ${PROJECT_SOURCE_DIR}/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/counterpoint/${folder}
          COMPONENT development)
endforeach()
install(DIRECTORY ${PROJECT_SOURCE_DIR}/data/ DESTINATION ${CMAKE_INSTALL_DATADIR}/counterpoint COMPONENT command)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/counterpoint)
install(EXPORT counterpointTargets NAMESPACE counterpoint:: DESTINATION ${package_dir} COMPONENT development)
install(TARGETS ${modules} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/counterpoint COMPONENT library)
set_target_properties(counterpoint PROPERTIES INSTALL_RPATH $ORIGIN/../${CMAKE_INSTALL_LIBDIR}/counterpoint)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/counterpointConfig.cmake.in
  ${PROJECT_BINARY_DIR}/counterpointConfig.cmake INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/counterpointConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/counterpointConfig.cmake
              ${PROJECT_BINARY_DIR}/counterpointConfigVersion.cmake
        DESTINATION ${package_dir} COMPONENT development)
set(documents ${CMAKE_INSTALL_DATADIR}/doc/counterpoint)
install(FILES ${PROJECT_SOURCE_DIR}/README.md ${PROJECT_SOURCE_DIR}/CHANGELOG.md DESTINATION ${documents} COMPONENT documents)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs DESTINATION ${documents} COMPONENT documents)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/apps/examples ${PROJECT_SOURCE_DIR}/apps/python/examples DESTINATION ${documents}
        COMPONENT documents)
include(CounterpointPackages)
