!> Writes what a member shows of itself: states of the points and the history, into its snapshot
!> file.
module sg_recorder
  use sg_errors, only: error_t
  use sg_kinds, only: i4, i8, wp
  use sg_observer, only: history_row_t, observer_t
  use sg_particles, only: particles_t
  use sg_property, only: PROPERTY_COHESION, PROPERTY_DENSITY, PROPERTY_DILATION_ANGLE, &
    PROPERTY_NAMES, PROPERTY_UNDRAINED_STRENGTH, PROPERTY_UNITS, PROPERTY_YOUNG
  use sg_snapshot, only: history_t, point_state_t, snapshot_t, varied_property_t
  implicit none
  private

  public :: recorder_t

  type, extends(observer_t) :: recorder_t
    private
    type(snapshot_t) :: file
    type(history_row_t), allocatable :: rows(:)
    integer :: row_count = 0
  contains
    procedure :: open => open_record
    procedure :: close => close_record
    procedure :: note_history
    procedure :: note_state
  end type recorder_t

contains

  !> Begins the record of member `id` of the case `label` in a folder of the run directory.
  !> Intervals in s, 0 for none.
  subroutine open_record(this, directory, folder, label, id, snapshot_interval, &
    history_interval, error)
    class(recorder_t), intent(inout) :: this
    character(len=*), intent(in) :: directory, folder, label
    integer(i8), intent(in) :: id
    real(wp), intent(in) :: snapshot_interval, history_interval
    type(error_t), allocatable, intent(out) :: error

    this%wants_ends = .true.
    this%wants_plastic_strain = .true.
    this%snapshot_interval = snapshot_interval
    this%history_interval = history_interval
    allocate (this%rows(64))
    this%row_count = 0
    call this%file%open(directory, folder, label, id, error)
  end subroutine open_record

  subroutine note_history(this, row)
    class(recorder_t), intent(inout) :: this
    type(history_row_t), intent(in) :: row
    type(history_row_t), allocatable :: longer(:)

    if (this%row_count == size(this%rows)) then
      allocate (longer(2*this%row_count))
      longer(:this%row_count) = this%rows
      call move_alloc(longer, this%rows)
    end if
    this%row_count = this%row_count + 1
    this%rows(this%row_count) = row
  end subroutine note_history

  subroutine note_state(this, step, time, particles)
    class(recorder_t), intent(inout) :: this
    integer, intent(in) :: step
    real(wp), intent(in) :: time
    type(particles_t), intent(in) :: particles
    type(point_state_t) :: state
    integer :: body

    associate (p => particles)
      state%step = step
      state%time = time
      state%position = transpose(reshape([p%x, p%y], [p%count, 2]))
      state%velocity = transpose(reshape([p%vx, p%vy], [p%count, 2]))
      state%displacement = state%position - transpose(reshape([p%x_start, p%y_start], [p%count, 2]))
      state%stress = transpose(reshape([p%sxx, p%syy, p%szz, p%sxy], [p%count, 4]))
      state%volume = p%volume
      state%friction_angle = p%friction_angle
      state%plastic_strain = p%plastic_strain
      allocate (state%varied(0))
      call add_varied(PROPERTY_COHESION, p%cohesion, state%varied)
      call add_varied(PROPERTY_UNDRAINED_STRENGTH, p%undrained_strength, state%varied)
      call add_varied(PROPERTY_YOUNG, p%young, state%varied)
      call add_varied(PROPERTY_DENSITY, p%density, state%varied)
      call add_varied(PROPERTY_DILATION_ANGLE, p%dilation_angle, state%varied)
      allocate (state%material(p%count))
      do body = 1, size(p%bodies)
        state%material(p%bodies(body)%first:p%bodies(body)%last) = int(p%bodies(body)%material, i4)
      end do
    end associate
    call this%file%add_state(state)
  end subroutine note_state

  !> Adds a property to those that vary, if it does.
  subroutine add_varied(property, values, varied)
    integer, intent(in) :: property
    !> [np], or size 0.
    real(wp), intent(in) :: values(:)
    type(varied_property_t), allocatable, intent(inout) :: varied(:)
    type(varied_property_t), allocatable :: longer(:)

    if (size(values) == 0) return
    allocate (longer(size(varied) + 1))
    longer(:size(varied)) = varied
    longer(size(longer))%name = trim(PROPERTY_NAMES(property))
    longer(size(longer))%units = trim(PROPERTY_UNITS(property))
    longer(size(longer))%values = values
    call move_alloc(longer, varied)
  end subroutine add_varied

  !> Writes the history, if any, and puts the file in its place.
  subroutine close_record(this, error)
    class(recorder_t), intent(inout) :: this
    type(error_t), allocatable, intent(out) :: error
    type(history_t) :: history
    integer :: k

    if (this%row_count > 0) then
      associate (rows => this%rows(:this%row_count))
        history%time = rows%time
        history%kinetic_energy = rows%kinetic_energy
        history%elastic_energy = rows%elastic_energy
        history%potential_energy = rows%potential_energy
        history%dissipated = rows%dissipated
        history%plastic_work = rows%plastic_work
        history%damping_work = rows%damping_work
        history%wall_work = rows%wall_work
        history%energy_error = rows%energy_error
        history%angular_momentum = rows%angular_momentum
        history%front_max = rows%front_max
        history%front_q995 = rows%front_q995
        history%height_max = rows%height_max
        allocate (history%momentum(2, this%row_count), history%centre(2, this%row_count))
        allocate (history%reaction(2, this%row_count))
        do k = 1, this%row_count
          history%momentum(:, k) = rows(k)%momentum
          history%centre(:, k) = rows(k)%centre
          history%reaction(:, k) = rows(k)%reaction
        end do
      end associate
      call this%file%add_history(history)
    end if
    call this%file%close(error)
  end subroutine close_record
end module sg_recorder
