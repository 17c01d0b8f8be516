!> What there is for threads: OpenMP, and cores.
module sg_threads
  use, intrinsic :: iso_c_binding, only: c_int
  use sg_text, only: to_text
  implicit none
  private

  public :: has_threads, core_set, usable_cores, threads_warning

  interface
    pure function sg_has_threads() bind(c) result(has)
      import :: c_int
      implicit none
      integer(c_int) :: has
    end function sg_has_threads

    function sg_usable_cores() bind(c) result(number)
      import :: c_int
      implicit none
      integer(c_int) :: number
    end function sg_usable_cores

    function sg_core_set() bind(c) result(number)
      import :: c_int
      implicit none
      integer(c_int) :: number
    end function sg_core_set
  end interface

contains

  !> Was this program built with OpenMP?
  pure function has_threads() result(has)
    logical :: has

    has = sg_has_threads() == 1
  end function has_threads

  !> Cores that this process may run on, which a launcher can have bound to some; 0: the operating
  !> system does not say.
  function usable_cores() result(number)
    integer :: number

    number = int(sg_usable_cores())
  end function usable_cores

  !> A number for the set of these cores: on one machine, processes with the same cores have the
  !> same number.
  function core_set() result(number)
    integer :: number

    number = int(sg_core_set())
  end function core_set

  !> What is wrong with so many `threads` in each of the `ranks` that share the cores of this
  !> process; empty if nothing is.
  function threads_warning(threads, ranks) result(text)
    integer, intent(in) :: threads, ranks
    character(len=:), allocatable :: text
    integer :: cores

    text = ''
    cores = usable_cores()
    if (threads == 1 .or. cores == 0 .or. threads*ranks <= cores) return
    text = 'threads of &solver: '//to_text(threads)//' in each of '//to_text(ranks)// &
      ' ranks that share '//to_text(cores)//' cores will wait for one another'
    if (ranks == 1) text = 'threads of &solver: '//to_text(threads)//' threads on '// &
      to_text(cores)//' cores will wait for one another'
    if (cores < threads) text = text//' (mpirun binds each rank to one core unless told '// &
      '--map-by slot:pe='//to_text(threads)//' or --bind-to none)'
  end function threads_warning
end module sg_threads
