# Installs contact/ when it is built alone: find_package(counterpoint_contact) then provides
# counterpoint::contact. In the whole project cmake/CounterpointInstall.cmake installs it.
include(CMakePackageConfigHelpers)
set(headers ${COUNTERPOINT_PUBLIC_HEADERS})
list(FILTER headers INCLUDE REGEX "^contact/")
list(TRANSFORM headers PREPEND ${counterpoint_root}/)
install(FILES ${headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/counterpoint/contact)
install(TARGETS counterpoint_contact EXPORT counterpoint_contactTargets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
        LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
        RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/counterpoint_contact)
install(EXPORT counterpoint_contactTargets NAMESPACE counterpoint:: DESTINATION ${package_dir})
file(WRITE ${PROJECT_BINARY_DIR}/counterpoint_contactConfig.cmake
"include(CMakeFindDependencyMacro)
find_dependency(Eigen3)
include(\"\${CMAKE_CURRENT_LIST_DIR}/counterpoint_contactTargets.cmake\")
")
write_basic_package_version_file(${PROJECT_BINARY_DIR}/counterpoint_contactConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/counterpoint_contactConfig.cmake
              ${PROJECT_BINARY_DIR}/counterpoint_contactConfigVersion.cmake
        DESTINATION ${package_dir})
