# kilvo_unity(TARGET [FILES]): the sources of the target are compiled FILES at a time, in one unit, so that what they share of headers is read
# and instantiated once. Modules with slow sources say a smaller number, so that no unit is waited for in the end. Names in anonymous
# namespaces are therefore different in all sources of a module, what two of them need stands in a header, and a file of tests has a namespace
# of its own name. Off where it would defeat a compiler cache (as KILVO_PRECOMPILE is) and in `dev`, which compiles each file alone: it finds
# what a file does not include.
option(KILVO_UNITY "Compile several sources of a module in one unit" ${default_precompile})

function(kilvo_unity target)
  if(NOT KILVO_UNITY)
    return()
  endif()
  set(files 12)
  if(ARGC GREATER 1)
    set(files ${ARGV1})
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE ${files})
endfunction()
