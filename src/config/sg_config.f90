!> The typed configuration of a run: what a case file says, with every default filled in and every
!> check passed. SI units, angles in degrees, as in the case file. Names and meanings are those of
!> `sgimp --keys`.
module sg_config
  use sg_kinds, only: i8, wp
  implicit none
  private

  public :: config_t, grid_config_t, material_config_t, body_config_t, boundary_config_t
  public :: loading_config_t
  public :: solver_config_t, random_field_config_t, cross_correlation_config_t
  public :: monte_carlo_config_t, study_config_t, study_list_t, control_variate_config_t
  public :: output_config_t
  public :: NAME_LENGTH, EDGE_TOLERANCE, nominal_value

  !> Length of names and of words out of a fixed choice.
  integer, parameter :: NAME_LENGTH = 64
  !> Share of a cell by which a place may miss the line it is meant to lie on: the rounding of a
  !> decimal number is 1e-16, a mistake is not below 1e-3.
  real(wp), parameter :: EDGE_TOLERANCE = 1.0e-6_wp

  type :: grid_config_t
    real(wp) :: x_min, x_max, y_min, y_max
    real(wp) :: cell_size
    character(len=NAME_LENGTH) :: left, right, bottom, top
    !> Coulomb friction of the walls that are frictional.
    real(wp) :: left_friction, right_friction, bottom_friction, top_friction
  end type grid_config_t

  type :: material_config_t
    character(len=NAME_LENGTH) :: name, model
    real(wp) :: density, young, poisson
    real(wp) :: friction_angle, dilation_angle, cohesion, tension_strength
    character(len=NAME_LENGTH) :: cone, softening
    real(wp) :: undrained_strength
    !> Strength left after softening, between these equivalent plastic strains.
    real(wp) :: residual_friction_angle, residual_cohesion, softening_start, softening_end
    !> Equivalent plastic strain at which dilation has faded to nothing; 0: never.
    real(wp) :: dilation_end
  end type material_config_t

  type :: body_config_t
    character(len=NAME_LENGTH) :: name, material, shape
    !> Index into `config_t%materials`.
    integer :: material_index
    !> Lower left corner of a rectangle, centre of a disc.
    real(wp) :: x, y
    real(wp) :: width, height, radius
    !> Corners of a polygon, x1, y1, x2, y2, ...; allocated with size 0 for other shapes.
    real(wp), allocatable :: vertices(:)
    !> Per direction.
    integer :: points_per_cell
    real(wp) :: velocity(2)
    !> About the centre of the body's box, 1/s.
    real(wp) :: angular_velocity
    !> File of the points of shape 'points'; empty for other shapes.
    character(len=:), allocatable :: file
  end type body_config_t

  !> Nodes in a box whose velocity is prescribed.
  type :: boundary_config_t
    character(len=NAME_LENGTH) :: name, components
    real(wp) :: x_min, x_max, y_min, y_max
    real(wp) :: velocity(2)
  end type boundary_config_t

  type :: loading_config_t
    real(wp) :: gravity(2)
    real(wp) :: damping
    character(len=NAME_LENGTH) :: initial_stress
    !> How the body is brought to rest before time 0, for at most so many seconds.
    character(len=NAME_LENGTH) :: relaxation
    real(wp) :: relaxation_time
    !> Body force beside gravity, and the amplitude of the manufactured solution in m.
    character(len=NAME_LENGTH) :: body_force
    real(wp) :: amplitude
  end type loading_config_t

  type :: solver_config_t
    !> What computes a member.
    character(len=NAME_LENGTH) :: model
    character(len=NAME_LENGTH) :: weighting, scheme, transfer, anti_locking, precision
    integer :: threads
    real(wp) :: flip
    real(wp) :: cfl
    !> Fixed time step in s, or 0: from the CFL number.
    real(wp) :: time_step
    real(wp) :: end_time
    real(wp) :: settle
    !> Work that is done although the scene can do without it; size 0 for none.
    character(len=NAME_LENGTH), allocatable :: needless(:)
  end type solver_config_t

  type :: random_field_config_t
    character(len=NAME_LENGTH) :: name, property, material, body, distribution, acf, form, averaging
    character(len=NAME_LENGTH) :: method
    !> Index into `config_t%materials` and `config_t%bodies`; 0 for all bodies.
    integer :: material_index, body_index
    !> Corners x1, y1, x2, y2, ...; size 0 for everywhere.
    real(wp), allocatable :: region(:)
    real(wp) :: mean, mean_gradient, sd_gradient, smoothness, scale_x, scale_y, rotation
    !> What may be left out: size 0 or 1.
    real(wp), allocatable :: cov(:), sd(:), datum(:), lower(:), upper(:)
    !> lower and upper, or what the property has instead of them: +-huge for no bound.
    real(wp) :: bounds(2)
    !> Files of measurements and of fields, and what they hold (a hash); empty for none.
    character(len=:), allocatable :: data, file, data_content, file_content
  end type random_field_config_t

  type :: cross_correlation_config_t
    !> Names of fields, and their indices into `config_t%random_fields`.
    character(len=NAME_LENGTH), allocatable :: between(:)
    integer :: fields(2)
    real(wp) :: coefficient
  end type cross_correlation_config_t

  type :: monte_carlo_config_t
    !> Total number of realizations of each case.
    integer :: realizations
    integer(i8) :: seed
    character(len=NAME_LENGTH) :: stop_rule, sampling
    !> Shift of importance sampling, in standard deviations of the spatial mean.
    real(wp) :: tilt
    !> What the rule looks at: a runout, of it the mean, sd or share above the threshold (m).
    character(len=NAME_LENGTH) :: stop_runout, stop_statistic
    real(wp) :: stop_threshold
    !> One of the two where the rule is 'precision', else size 0: m or a probability; a share of the
    !> estimate.
    real(wp), allocatable :: half_width(:), relative_half_width(:)
    !> Change of the mean in m and of the variance in m^2.
    real(wp) :: successive_tolerance
    !> Members before the first look of the rule and between two looks.
    integer :: stop_minimum, stop_batch
    !> Members of the homogeneous case: 1 nominal and the rest with meaningless perturbations.
    integer :: noise_members
    !> Share of failed members up to which the run still counts as good (exit code 0).
    real(wp) :: max_failed_fraction
    !> Wall clock limit of one member in s; 0 = none.
    real(wp) :: member_seconds
  end type monte_carlo_config_t

  !> A key of another group that the study lists.
  type :: study_list_t
    !> As it is written in &study: `damping`, `grid%x_max` or `body(2)%height`.
    character(len=NAME_LENGTH) :: name = ''
    !> Its row in KEYS of sg_schema, and the number of its group among those of its name.
    integer :: row = 0, occurrence = 1
    !> Numbers in their shortest text, or words.
    character(len=NAME_LENGTH), allocatable :: values(:)
  end type study_list_t

  type :: study_config_t
    !> Every combination is a case, by the first field. Size 1 with the value of &random_field where
    !> &study does not list the key; cov is 0 where that field has sd instead.
    character(len=NAME_LENGTH), allocatable :: acf(:)
    real(wp), allocatable :: cov(:)
    !> The other keys, in the order of the file. Their groups hold the first value of each.
    type(study_list_t), allocatable :: lists(:)
  end type study_config_t

  !> The twins on coarser cells, and how many realizations of them there are.
  type :: control_variate_config_t
    real(wp) :: cell_size = 0.0_wp
    integer :: realizations = 0
  end type control_variate_config_t

  type :: output_config_t
    character(len=:), allocatable :: directory
    !> Time between snapshots and between rows of the history, in s; 0 = none.
    real(wp) :: snapshot_interval, history_interval
    !> Realizations whose first and last state is written during a sweep; size 0 for none.
    integer, allocatable :: snapshot_members(:)
    !> Wall clock seconds between progress lines and between rewrites of ensemble.h5.
    real(wp) :: report_seconds
  end type output_config_t

  type :: config_t
    character(len=NAME_LENGTH) :: name
    character(len=:), allocatable :: title
    type(grid_config_t) :: grid
    type(material_config_t), allocatable :: materials(:)
    type(body_config_t), allocatable :: bodies(:)
    type(boundary_config_t), allocatable :: boundaries(:)
    type(loading_config_t) :: loading
    type(solver_config_t) :: solver
    !> False: no &random_field group, the run is deterministic.
    logical :: has_random_field = .false.
    type(random_field_config_t), allocatable :: random_fields(:)
    type(cross_correlation_config_t), allocatable :: cross_correlations(:)
    type(monte_carlo_config_t) :: monte_carlo
    !> False: no &study group, the heterogeneous case is called `base`.
    logical :: has_study = .false.
    type(study_config_t) :: study
    logical :: has_control_variate = .false.
    type(control_variate_config_t) :: control_variate
    type(output_config_t) :: output
  end type config_t
contains

  !> What a material says of a property that random fields can vary; of the friction angle for its
  !> tangent.
  pure real(wp) function nominal_value(material, property) result(value)
    type(material_config_t), intent(in) :: material
    character(len=*), intent(in) :: property

    select case (property)
    case ('cohesion')
      value = material%cohesion
    case ('undrained_strength')
      value = material%undrained_strength
    case ('young')
      value = material%young
    case ('density')
      value = material%density
    case ('dilation_angle')
      value = material%dilation_angle
    case default
      value = material%friction_angle
    end select
  end function nominal_value
end module sg_config
