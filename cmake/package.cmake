# `cmake --install` gives a package that another project uses with find_package(kilvo); the target is kilvo::kilvo.
include(CMakePackageConfigHelpers)

if(TARGET programs)
  add_dependencies(programs ${KILVO_MODULE_TARGETS})
endif()
install(TARGETS ${KILVO_MODULE_TARGETS} EXPORT kilvoTargets
        ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
foreach(module ${KILVO_MODULE_TARGETS})
  get_target_property(folder ${module} SOURCE_DIR)
  file(RELATIVE_PATH path ${PROJECT_SOURCE_DIR} ${folder})
  install(DIRECTORY ${folder}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${path} COMPONENT development FILES_MATCHING PATTERN "*.hpp")
endforeach()
install(EXPORT kilvoTargets NAMESPACE kilvo:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kilvo COMPONENT development)
# Beside the estimator: the live runner, configuration files, message decoding and what a node does. Components of the package, for they
# need more.
if(TARGET kilvo_node_core)
  set(more kilvo_lab_clocks kilvo_lab_contacts kilvo_lab_messages kilvo_lab_mapping kilvo_lab_settings kilvo_lab_doctor kilvo_live kilvo_node_core)
  set(names clocks contacts messages mapping settings doctor live node)
  foreach(target name IN ZIP_LISTS more names)
    set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
    target_include_directories(${target} INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/kilvo-live>)
    get_target_property(folder ${target} SOURCE_DIR)
    file(RELATIVE_PATH path ${PROJECT_SOURCE_DIR} ${folder})
    install(DIRECTORY ${folder}/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/kilvo-live/${path} COMPONENT development FILES_MATCHING PATTERN "*.hpp")
  endforeach()
  if(TARGET programs)
    add_dependencies(programs ${more})
  endif()
  install(TARGETS ${more} EXPORT kilvoLiveTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
  install(EXPORT kilvoLiveTargets NAMESPACE kilvo:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kilvo COMPONENT development)
endif()
configure_package_config_file(cmake/kilvoConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/kilvoConfig.cmake
                              INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kilvo)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/kilvoConfigVersion.cmake COMPATIBILITY SameMajorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/kilvoConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/kilvoConfigVersion.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/kilvo COMPONENT development)
install(DIRECTORY config/ DESTINATION ${CMAKE_INSTALL_DATADIR}/kilvo/config COMPONENT program)
include(cmake/debian.cmake)
