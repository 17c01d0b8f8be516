!> What a case file may hold: one row for each group and each key. Scanning, checking, reading,
!> `resolved.nml`, `--keys` and `--defaults` all follow this table.
!>
!> A new key needs a row here, a line in `sg_config_fields` and a component of `config_t`. Any key
!> of one number or word may also be listed in &study (sg_study_keys).
module sg_schema
  implicit none
  private

  public :: group_t, key_t
  public :: GROUPS, KEYS
  public :: KIND_REAL, KIND_INTEGER, KIND_WORD, KIND_NAME, KIND_TEXT, ANY_NUMBER
  public :: group_row, key_row, has_word, count_words, word_at, listed

  integer, parameter :: KIND_REAL = 1
  integer, parameter :: KIND_INTEGER = 2
  !> One word of `choices`, in any case.
  integer, parameter :: KIND_WORD = 3
  !> Letters, digits, `_`, `-` and `.`; used in labels and to refer to a material.
  integer, parameter :: KIND_NAME = 4
  !> Any text.
  integer, parameter :: KIND_TEXT = 5

  !> `size` of a key that takes a list of one or more values.
  integer, parameter :: ANY_NUMBER = 0

  type :: group_t
    character(len=20) :: name
    character(len=240) :: meaning
    logical :: required = .false.
    logical :: repeatable = .false.
    !> Group without which this one makes no sense.
    character(len=16) :: needs = ''
    !> Shown by `--defaults`.
    logical :: in_example = .true.
  end type group_t

  type :: key_t
    character(len=20) :: group
    character(len=40) :: name
    integer :: kind
    character(len=8) :: unit = ''
    !> Value of a key that is not given, as in a case file but without quotes; lists with blanks.
    character(len=24) :: default = ''
    !> The same for a run without &random_field, where it differs.
    character(len=24) :: default_deterministic = ''
    !> Value shown by `--defaults` where there is no default (the paper's case).
    character(len=64) :: example = ''
    !> Interval of numbers: '[' and ']' include the bound, '(' and ')' exclude it; a missing bound
    !> is no bound.
    character(len=24) :: range = '(,)'
    character(len=128) :: choices = ''
    !> Number of values, or ANY_NUMBER.
    integer :: size = 1
    !> Must be given wherever it applies.
    logical :: required = .false.
    !> Applies only where key `when` of the same group has one of the words `when_is`.
    character(len=16) :: when = ''
    character(len=64) :: when_is = ''
    !> Group without which the key makes no sense.
    character(len=16) :: needs = ''
    !> Not required where this group gives the key of the same name.
    character(len=16) :: supplied_by = ''
    !> Results depend on it: a run is resumed only with the same value.
    logical :: identity = .true.
    character(len=192) :: meaning = ''
  end type key_t

  type(group_t), parameter :: GROUPS(*) = [ &
    group_t('case', 'What the run is called', required=.true.), &
    group_t('grid', 'Background grid of square cells and its four walls', required=.true.), &
    group_t('material', 'A material; one group for each', required=.true., repeatable=.true.), &
    group_t('body', 'A body filled with material points; one group for each', &
    required=.true., repeatable=.true.), &
    group_t('boundary', 'Prescribed velocity of the nodes in a box; one group for each', &
    repeatable=.true., in_example=.false.), &
    group_t('loading', 'Gravity, damping and the stress at the start'), &
    group_t('solver', 'Discretisation in space and time', required=.true.), &
    group_t('random_field', 'Random field of a material property, one group for each; without '// &
    'this group the run is deterministic', repeatable=.true.), &
    group_t('cross_correlation', 'Correlation between two random fields; one group for each', &
    repeatable=.true., needs='random_field', in_example=.false.), &
    group_t('monte_carlo', 'How many realizations, and when a run counts as good'), &
    group_t('study', 'Every combination of the listed values is a case, with the same random '// &
    'numbers in all. Beside acf and cov, any key of one number or word may be listed: damping '// &
    '= 0.4, 0.7, or body(2)%height where its name alone is not clear'), &
    group_t('control_variate', 'A cheap twin of every study case on coarser cells, with the '// &
    'same random numbers: control variate of the two-level estimator', needs='random_field', &
    in_example=.false.), &
    group_t('output', 'Where results go, and how many')]

  type(key_t), parameter :: CASE_KEYS(*) = [ &
    key_t('case', 'name', KIND_NAME, example='sand_collapse', required=.true., &
    identity=.false., meaning='Short name of the run'), &
    key_t('case', 'title', KIND_TEXT, identity=.false., meaning='One line for the report')]

  character(len=*), parameter :: WALLS = 'fixed roller free frictional'
  character(len=*), parameter :: WALL_MEANING = 'fixed: nothing moves; roller: free to slide '// &
    'along it; free: no condition; frictional: Coulomb friction with stick, may lift off'
  character(len=*), parameter :: FRICTION_MEANING = 'Coulomb friction coefficient of this wall'

  type(key_t), parameter :: GRID_KEYS(*) = [ &
    key_t('grid', 'x_min', KIND_REAL, unit='m', default='0', meaning='Left edge'), &
    key_t('grid', 'x_max', KIND_REAL, unit='m', example='20', required=.true., &
    meaning='Right edge, a whole number of cells from x_min'), &
    key_t('grid', 'y_min', KIND_REAL, unit='m', default='0', meaning='Lower edge'), &
    key_t('grid', 'y_max', KIND_REAL, unit='m', example='6.25', required=.true., &
    meaning='Upper edge, a whole number of cells from y_min'), &
    key_t('grid', 'cell_size', KIND_REAL, unit='m', example='0.125', range='(0,)', &
    required=.true., meaning='Side of a cell'), &
    key_t('grid', 'left', KIND_WORD, default='roller', choices=WALLS, &
    meaning='Wall at x_min. '//WALL_MEANING), &
    key_t('grid', 'right', KIND_WORD, default='roller', choices=WALLS, &
    meaning='Wall at x_max'), &
    key_t('grid', 'bottom', KIND_WORD, default='fixed', choices=WALLS, &
    meaning='Wall at y_min'), &
    key_t('grid', 'top', KIND_WORD, default='free', choices=WALLS, &
    meaning='Wall at y_max'), &
    key_t('grid', 'left_friction', KIND_REAL, range='[0,)', example='0.5', required=.true., &
    when='left', when_is='frictional', meaning=FRICTION_MEANING), &
    key_t('grid', 'right_friction', KIND_REAL, range='[0,)', example='0.5', required=.true., &
    when='right', when_is='frictional', meaning=FRICTION_MEANING), &
    key_t('grid', 'bottom_friction', KIND_REAL, range='[0,)', example='0.5', required=.true., &
    when='bottom', when_is='frictional', meaning=FRICTION_MEANING), &
    key_t('grid', 'top_friction', KIND_REAL, range='[0,)', example='0.5', required=.true., &
    when='top', when_is='frictional', meaning=FRICTION_MEANING)]

  character(len=*), parameter :: FRICTIONAL_MODELS = 'mohr_coulomb drucker_prager'

  type(key_t), parameter :: MATERIAL_KEYS(*) = [ &
    key_t('material', 'name', KIND_NAME, example='sand', required=.true., &
    meaning='Name that bodies and the random field refer to'), &
    key_t('material', 'model', KIND_WORD, example='mohr_coulomb', required=.true., &
    choices='linear_elastic neo_hookean mohr_coulomb drucker_prager von_mises tresca', &
    meaning='Constitutive model'), &
    key_t('material', 'density', KIND_REAL, unit='kg/m^3', example='1450', range='(0,)', &
    required=.true., meaning='Density at the start'), &
    key_t('material', 'young', KIND_REAL, unit='Pa', example='2.6e6', range='(0,)', &
    required=.true., meaning='Young''s modulus'), &
    key_t('material', 'poisson', KIND_REAL, unit='1', example='0.31', range='(-1,0.5)', &
    required=.true., meaning='Poisson''s ratio'), &
    key_t('material', 'friction_angle', KIND_REAL, unit='deg', example='35', range='[0,90)', &
    required=.true., when='model', when_is=FRICTIONAL_MODELS, &
    meaning='Angle of internal friction; equal to mean of &random_field where that varies it'), &
    key_t('material', 'dilation_angle', KIND_REAL, unit='deg', default='0', range='[0,90)', &
    when='model', when_is=FRICTIONAL_MODELS, meaning='Dilation angle, at most friction_angle'), &
    key_t('material', 'cohesion', KIND_REAL, unit='Pa', default='0', range='[0,)', &
    when='model', when_is=FRICTIONAL_MODELS, meaning='Cohesion'), &
    key_t('material', 'tension_strength', KIND_REAL, unit='Pa', default='0', range='[0,)', &
    when='model', when_is=FRICTIONAL_MODELS, meaning='Cut-off of tensile stress'), &
    key_t('material', 'cone', KIND_WORD, default='plane_strain', &
    choices='plane_strain plane_strain_associated outer inner equal_area', when='model', &
    when_is='drucker_prager', meaning='How the cone is fitted to the Mohr-Coulomb pyramid: in '// &
    'plane strain with its dilation, or with psi = phi; at triaxial compression or extension'), &
    key_t('material', 'undrained_strength', KIND_REAL, unit='Pa', example='1e3', range='(0,)', &
    required=.true., when='model', when_is='von_mises tresca', &
    meaning='Undrained shear strength'), &
    key_t('material', 'softening', KIND_WORD, default='none', choices='none linear', &
    when='model', when_is='mohr_coulomb', &
    meaning='How strength falls with equivalent plastic strain'), &
    key_t('material', 'residual_friction_angle', KIND_REAL, unit='deg', example='30', &
    range='[0,90)', required=.true., when='softening', when_is='linear', &
    meaning='Angle of internal friction after softening; points that start lower keep theirs'), &
    key_t('material', 'residual_cohesion', KIND_REAL, unit='Pa', default='0', range='[0,)', &
    when='softening', when_is='linear', meaning='Cohesion after softening'), &
    key_t('material', 'softening_start', KIND_REAL, unit='1', default='0', range='[0,)', &
    when='softening', when_is='linear', &
    meaning='Equivalent plastic strain sqrt(2/3 e:e) at which softening begins'), &
    key_t('material', 'softening_end', KIND_REAL, unit='1', example='0.1', range='(0,)', &
    required=.true., when='softening', when_is='linear', &
    meaning='Equivalent plastic strain at which only the residual strength is left'), &
    key_t('material', 'dilation_end', KIND_REAL, unit='1', default='0', range='[0,)', &
    when='model', when_is='mohr_coulomb', &
    meaning='Equivalent plastic strain at which the dilation angle has faded to 0; 0: never')]

  type(key_t), parameter :: BOUNDARY_KEYS(*) = [ &
    key_t('boundary', 'name', KIND_NAME, example='footing', required=.true., meaning='Name'), &
    key_t('boundary', 'x_min', KIND_REAL, unit='m', example='0', required=.true., &
    meaning='Left edge of the box of nodes'), &
    key_t('boundary', 'x_max', KIND_REAL, unit='m', example='1', required=.true., &
    meaning='Right edge, at least x_min'), &
    key_t('boundary', 'y_min', KIND_REAL, unit='m', example='5', required=.true., &
    meaning='Lower edge'), &
    key_t('boundary', 'y_max', KIND_REAL, unit='m', example='5.25', required=.true., &
    meaning='Upper edge, at least y_min'), &
    key_t('boundary', 'components', KIND_WORD, default='both', choices='both x y', &
    meaning='Components of the velocity that are prescribed'), &
    key_t('boundary', 'velocity', KIND_REAL, unit='m/s', default='0 0', size=2, &
    meaning='Prescribed velocity: x, y')]

  type(key_t), parameter :: BODY_KEYS(*) = [ &
    key_t('body', 'name', KIND_NAME, example='column', required=.true., meaning='Name'), &
    key_t('body', 'material', KIND_NAME, example='sand', required=.true., &
    meaning='Name of its material'), &
    key_t('body', 'shape', KIND_WORD, example='rectangle', required=.true., &
    choices='rectangle disc polygon points', meaning='Shape at the start'), &
    key_t('body', 'x', KIND_REAL, unit='m', example='0', required=.true., when='shape', &
    when_is='rectangle disc', meaning='Left edge of a rectangle, centre of a disc'), &
    key_t('body', 'y', KIND_REAL, unit='m', example='0', required=.true., when='shape', &
    when_is='rectangle disc', meaning='Lower edge of a rectangle, centre of a disc'), &
    key_t('body', 'width', KIND_REAL, unit='m', example='5', range='(0,)', required=.true., &
    when='shape', when_is='rectangle', meaning='Extent along x'), &
    key_t('body', 'height', KIND_REAL, unit='m', example='5', range='(0,)', required=.true., &
    when='shape', when_is='rectangle', meaning='Extent along y'), &
    key_t('body', 'radius', KIND_REAL, unit='m', example='1', range='(0,)', required=.true., &
    when='shape', when_is='disc', meaning='Radius'), &
    key_t('body', 'vertices', KIND_REAL, unit='m', example='0 0 5 0 0 5', size=ANY_NUMBER, &
    required=.true., when='shape', when_is='polygon', &
    meaning='Corners x1, y1, x2, y2, ... in order, clockwise or not'), &
    key_t('body', 'file', KIND_TEXT, example='points.csv', required=.true., when='shape', &
    when_is='points', meaning='CSV file of material points, first line x,y,width,height or '// &
    'x,y,width,height,vx,vy; its path counts from the directory of the case file'), &
    key_t('body', 'points_per_cell', KIND_INTEGER, default='2', range='[1,10]', when='shape', &
    when_is='rectangle disc polygon', meaning='Material points in a cell, along each direction'), &
    key_t('body', 'velocity', KIND_REAL, unit='m/s', default='0 0', size=2, &
    meaning='Velocity at the start: x, y'), &
    key_t('body', 'angular_velocity', KIND_REAL, unit='1/s', default='0', &
    meaning='Spin at the start about the centre of the box around the body')]

  type(key_t), parameter :: LOADING_KEYS(*) = [ &
    key_t('loading', 'gravity', KIND_REAL, unit='m/s^2', default='0 -9.81', size=2, &
    meaning='Acceleration of gravity: x, y'), &
    key_t('loading', 'damping', KIND_REAL, unit='1/s', default='0', range='[0,)', &
    meaning='Coefficient c_d of the force -c_d m v on the nodes (Eq. 14 of the paper)'), &
    key_t('loading', 'initial_stress', KIND_WORD, default='none', choices='none geostatic', &
    meaning='none: gravity is switched on; geostatic: in balance with gravity, within the '// &
    'yield surface'), &
    key_t('loading', 'relaxation', KIND_WORD, default='none', choices='none open gated', &
    meaning='Damped stage before time 0 that lets gravity act: gated holds the body by a '// &
    'roller at its toe, open does not'), &
    key_t('loading', 'relaxation_time', KIND_REAL, unit='s', example='2', range='(0,)', &
    required=.true., when='relaxation', when_is='open gated', &
    meaning='Longest time of that stage; it ends earlier at rest'), &
    key_t('loading', 'body_force', KIND_WORD, default='none', choices='none manufactured', &
    meaning='manufactured: force and first velocity of the manufactured solution on the unit '// &
    'square (verification)'), &
    key_t('loading', 'amplitude', KIND_REAL, unit='m', example='1e-4', range='(0,0.3]', &
    required=.true., when='body_force', when_is='manufactured', &
    meaning='Amplitude of the manufactured solution')]

  character(len=*), parameter :: NEEDLESS_WORK = 'empty_nodes zero_weights gaps cracks '// &
    'dilation exact_return deformation plastic_strain velocity_gradient wave_speed ledger'

  type(key_t), parameter :: SOLVER_KEYS(*) = [ &
    key_t('solver', 'model', KIND_WORD, default='gimp', choices='gimp linear_functional', &
    meaning='linear_functional: nothing moves, runouts are weighted means of the first field, '// &
    'whose statistics are known exactly (check of the Monte Carlo engine, docs/statistics.md)'), &
    key_t('solver', 'weighting', KIND_WORD, default='gimp', &
    choices='linear gimp cpgimp bspline', meaning='Weighting function of a point: gimp is '// &
    'uGIMP, in cpgimp its domain follows its stretch, bspline is quadratic'), &
    key_t('solver', 'scheme', KIND_WORD, default='musl', choices='usf usl musl', &
    meaning='When stress is updated: first, last, or last with momentum mapped anew'), &
    key_t('solver', 'transfer', KIND_WORD, default='flip', choices='flip tpic', &
    meaning='What points keep of their velocity: flip adds the change on the grid to it, tpic '// &
    'takes that of the grid with its gradient'), &
    key_t('solver', 'flip', KIND_REAL, unit='1', default='1', range='[0,1]', when='transfer', &
    when_is='flip', meaning='Share of FLIP in the velocity update; the rest is PIC'), &
    key_t('solver', 'anti_locking', KIND_WORD, default='none', choices='none cell_average', &
    meaning='Volumetric strain of a point: its own, or the mean of its cell (nearly '// &
    'incompressible behaviour)'), &
    key_t('solver', 'precision', KIND_WORD, default='double', choices='double single', &
    meaning='Of the numbers of points and nodes; times, energies and fields are double'), &
    key_t('solver', 'threads', KIND_INTEGER, default='1', range='[1,1024]', identity=.false., &
    meaning='Cores that work on one member together, in each rank; the results are the same'), &
    key_t('solver', 'time_step', KIND_REAL, unit='s', range='(0,)', &
    meaning='Fixed time step; overrides cfl'), &
    key_t('solver', 'cfl', KIND_REAL, unit='1', default='0.4', range='(0,1.5]', &
    meaning='Time step as a share of the time that a wave or a point needs to cross a cell'), &
    key_t('solver', 'end_time', KIND_REAL, unit='s', example='5', range='(0,)', required=.true., &
    meaning='Time at which a run ends, at the latest'), &
    key_t('solver', 'settle', KIND_REAL, unit='1', default='1e-4', range='[0,1)', &
    meaning='End once kinetic energy stays under this share of its peak, front still; 0: never'), &
    key_t('solver', 'needless', KIND_WORD, size=ANY_NUMBER, choices=NEEDLESS_WORK, &
    meaning='Work that is done although the scene can do without it: for tests of what is '// &
    'skipped, and of what that saves (docs/skips.md)')]

  character(len=*), parameter :: STUDY_ACFS = 'snx sqx smk csx bin matern32 matern52 spherical'
  character(len=*), parameter :: ACFS = STUDY_ACFS//' matern'

  type(key_t), parameter :: RANDOM_FIELD_KEYS(*) = [ &
    key_t('random_field', 'name', KIND_NAME, meaning='Name in messages and results, where '// &
    'several fields have the same property; without it the property'), &
    key_t('random_field', 'property', KIND_WORD, default='friction_angle', &
    choices='friction_angle tan_friction_angle cohesion undrained_strength young density '// &
    'dilation_angle', meaning='Property that varies; tan_friction_angle: the tangent of the '// &
    'friction angle has the distribution'), &
    key_t('random_field', 'material', KIND_NAME, example='sand', required=.true., &
    meaning='Name of the material whose property varies'), &
    key_t('random_field', 'body', KIND_NAME, &
    meaning='Name of a body: the field is for its points alone'), &
    key_t('random_field', 'region', KIND_REAL, unit='m', size=ANY_NUMBER, &
    meaning='Corners x1, y1, x2, y2, ... of a polygon: the field is for the points in it. '// &
    'Of several fields of a property at a point the last one counts'), &
    key_t('random_field', 'distribution', KIND_WORD, default='normal', &
    choices='normal lognormal truncated_normal beta gamma gumbel weibull uniform', &
    meaning='Marginal distribution; truncated_normal and beta end at lower and upper'), &
    key_t('random_field', 'mean', KIND_REAL, unit='*', example='35', &
    required=.true., meaning='Mean before values are set to the bounds (truncated_normal: '// &
    'before it is cut), in the unit of the property'), &
    key_t('random_field', 'cov', KIND_REAL, unit='1', example='0.05', range='(0,2]', &
    meaning='Coefficient of variation, as the mean; or sd. cov of &study replaces that of the '// &
    'first field'), &
    key_t('random_field', 'sd', KIND_REAL, unit='*', range='(0,)', &
    meaning='Standard deviation instead of cov'), &
    key_t('random_field', 'mean_gradient', KIND_REAL, unit='*/m', default='0', &
    meaning='Growth of the mean with each metre below the datum'), &
    key_t('random_field', 'sd_gradient', KIND_REAL, unit='*/m', default='0', &
    meaning='Growth of sd with each metre below the datum; with cov, sd follows the mean'), &
    key_t('random_field', 'datum', KIND_REAL, unit='m', &
    meaning='Height y at which mean and sd hold; without it the highest point of the field'), &
    key_t('random_field', 'acf', KIND_WORD, example='snx', required=.true., &
    choices=ACFS, supplied_by='study', meaning='Autocorrelation function: the five of Table 1 '// &
    'of the paper, Matern, spherical. acf of &study replaces that of the first field, and is '// &
    'that of others without one'), &
    key_t('random_field', 'smoothness', KIND_REAL, unit='1', example='1.5', range='(0,50]', &
    required=.true., when='acf', when_is='matern', meaning='nu of the Matern function'), &
    key_t('random_field', 'form', KIND_WORD, default='product', choices='product radial', &
    meaning='rho(x/scale_x) rho(y/scale_y), or rho of the distance in scales of fluctuation'), &
    key_t('random_field', 'scale_x', KIND_REAL, unit='m', example='0.2', range='(0,)', &
    required=.true., meaning='Scale of fluctuation along x, or along the bedding'), &
    key_t('random_field', 'scale_y', KIND_REAL, unit='m', example='0.2', range='(0,)', &
    required=.true., meaning='Scale of fluctuation along y, or across the bedding'), &
    key_t('random_field', 'rotation', KIND_REAL, unit='deg', default='0', range='[-180,180]', &
    meaning='Angle of the bedding from x, counter-clockwise'), &
    key_t('random_field', 'averaging', KIND_WORD, default='none', choices='none cell', &
    meaning='none: values of points; cell: averages over the cell of each point, which vary '// &
    'less'), &
    key_t('random_field', 'lower', KIND_REAL, unit='*', meaning='Values below are set to it, '// &
    'the share of such points is reported. Without it: friction 1 deg, young and density 1 % '// &
    'of the mean, others 0'), &
    key_t('random_field', 'upper', KIND_REAL, unit='*', meaning='Values above are set to it. '// &
    'Without it: angles 60 deg, others unlimited'), &
    key_t('random_field', 'method', KIND_WORD, default='auto', &
    choices='auto kronecker cholesky circulant', &
    meaning='How fields are sampled; auto takes the cheapest exact one for the points'), &
    key_t('random_field', 'data', KIND_TEXT, identity=.false., &
    meaning='CSV file of measurements, first line '// &
    'x,y,value,error: fields agree with them up to the error (its standard deviation). Its '// &
    'path counts from the case file'), &
    key_t('random_field', 'data_content', KIND_TEXT, meaning='Hash of that file, written by '// &
    'the program: with it, a file that has changed is refused'), &
    key_t('random_field', 'file', KIND_TEXT, identity=.false., &
    meaning='File of fields made elsewhere or by '// &
    '--write-fields, HDF5 or CSV: taken instead of sampling. Its path counts from the case file'), &
    key_t('random_field', 'file_content', KIND_TEXT, meaning='Hash of that file, as data_content')]

  type(key_t), parameter :: CROSS_CORRELATION_KEYS(*) = [ &
    key_t('cross_correlation', 'between', KIND_NAME, size=2, example='friction_angle cohesion', &
    required=.true., meaning='Names of two random fields'), &
    key_t('cross_correlation', 'coefficient', KIND_REAL, unit='1', range='(-1,1)', &
    example='-0.5', required=.true., &
    meaning='Correlation of the two underlying Gaussian fields at the same point')]

  character(len=*), parameter :: RUNOUTS = 'runout_max runout_q99 runout_q995 runout_connected'
  character(len=*), parameter :: EARLY_RULES = 'precision successive'

  type(key_t), parameter :: MONTE_CARLO_KEYS(*) = [ &
    key_t('monte_carlo', 'realizations', KIND_INTEGER, example='100', range='[1,1000000000]', &
    required=.true., needs='random_field', identity=.false., &
    meaning='Realizations of each case, in total, the most of them with a stop_rule: a resumed '// &
    'run may ask for more'), &
    key_t('monte_carlo', 'seed', KIND_INTEGER, default='2022', range='[0,)', &
    meaning='First word of the key of the random numbers (Philox4x64-10)'), &
    key_t('monte_carlo', 'sampling', KIND_WORD, default='random', &
    choices='random antithetic latin_hypercube importance', needs='random_field', &
    meaning='random: members are independent; antithetic: every second one mirrors the one '// &
    'before; latin_hypercube: stratified over all realizations; importance: weighted, by tilt'), &
    key_t('monte_carlo', 'tilt', KIND_REAL, unit='1', range='[-8,8]', example='-2.5', &
    required=.true., &
    when='sampling', when_is='importance', meaning='Importance sampling: shift of the spatial '// &
    'mean of the first Gaussian field, in its own standard deviations'), &
    key_t('monte_carlo', 'stop_rule', KIND_WORD, default='count', &
    choices='count precision successive', needs='random_field', identity=.false., &
    meaning='When to end a case: after all realizations; once the 95 % interval of a statistic '// &
    'is narrow; once mean and variance hardly change (docs/stopping.md)'), &
    key_t('monte_carlo', 'stop_runout', KIND_WORD, default='runout_q995', choices=RUNOUTS, &
    when='stop_rule', when_is=EARLY_RULES, identity=.false., &
    meaning='Runout that the rule looks at'), &
    key_t('monte_carlo', 'stop_statistic', KIND_WORD, default='mean', &
    choices='mean sd exceedance', when='stop_rule', when_is='precision', identity=.false., &
    meaning='What must be known well: mean, standard deviation, or the probability of a runout '// &
    'beyond stop_threshold'), &
    key_t('monte_carlo', 'stop_threshold', KIND_REAL, unit='m', example='5', required=.true., &
    when='stop_statistic', when_is='exceedance', identity=.false., &
    meaning='Runout s* of the probability P(runout > s*)'), &
    key_t('monte_carlo', 'half_width', KIND_REAL, unit='m', range='(0,)', when='stop_rule', &
    when_is='precision', identity=.false., meaning='Half of the 95 % interval at which a case '// &
    'ends; of exceedance a probability, without unit. This key or relative_half_width'), &
    key_t('monte_carlo', 'relative_half_width', KIND_REAL, unit='1', range='(0,1)', &
    when='stop_rule', when_is='precision', identity=.false., &
    meaning='The same as a share of the estimate'), &
    key_t('monte_carlo', 'successive_tolerance', KIND_REAL, unit='1', default='1e-3', &
    range='(0,)', when='stop_rule', when_is='successive', identity=.false., &
    meaning='A case ends once the last member changes the mean (m) and the variance (m^2) by '// &
    'less; no bound of any error. The paper has 1e-3, presumably in dm and dm^2'), &
    key_t('monte_carlo', 'stop_minimum', KIND_INTEGER, default='50', range='[10,1000000000]', &
    when='stop_rule', when_is=EARLY_RULES, identity=.false., &
    meaning='Members of a case before the rule is first looked at; an even number of '// &
    'antithetic ones'), &
    key_t('monte_carlo', 'stop_batch', KIND_INTEGER, default='10', range='[1,1000000000]', &
    when='stop_rule', when_is=EARLY_RULES, identity=.false., &
    meaning='Members between two such looks; an even number of antithetic ones'), &
    key_t('monte_carlo', 'noise_members', KIND_INTEGER, default='8', default_deterministic='1', &
    range='[1,1000000]', identity=.false., &
    meaning='Runs of the homogeneous case: one as given, the others with perturbations that '// &
    'mean nothing, whose spread is the noise floor'), &
    key_t('monte_carlo', 'max_failed_fraction', KIND_REAL, unit='1', default='0.01', &
    range='[0,1]', identity=.false., &
    meaning='Share of failed members from which on the program ends with exit code 4'), &
    key_t('monte_carlo', 'member_seconds', KIND_REAL, unit='s', default='0', range='[0,)', &
    identity=.false., meaning='Wall clock limit of one member; 0: none')]

  type(key_t), parameter :: STUDY_KEYS(*) = [ &
    key_t('study', 'acf', KIND_WORD, example='snx sqx', size=ANY_NUMBER, &
    choices=STUDY_ACFS, needs='random_field', meaning='Autocorrelation functions of the first '// &
    'field'), &
    key_t('study', 'cov', KIND_REAL, unit='1', example='0.05 0.10', range='(0,2]', &
    size=ANY_NUMBER, needs='random_field', meaning='Coefficients of variation of the first '// &
    'field')]

  type(key_t), parameter :: CONTROL_VARIATE_KEYS(*) = [ &
    key_t('control_variate', 'cell_size', KIND_REAL, unit='m', example='0.25', range='(0,)', &
    required=.true., meaning='Side of a cell of the twins, above that of &grid. Their fields '// &
    'are those of the cases, averaged over the domains of their points'), &
    key_t('control_variate', 'realizations', KIND_INTEGER, example='800', &
    range='[1,1000000000]', required=.true., identity=.false., meaning='Realizations of each '// &
    'twin, at least as many as of the case; sgimp-post allocate says how many pay')]

  type(key_t), parameter :: OUTPUT_KEYS(*) = [ &
    key_t('output', 'directory', KIND_TEXT, default='runs/<name>', identity=.false., &
    meaning='Directory of the results, made if it is not there; <name> is name of &case'), &
    key_t('output', 'snapshot_interval', KIND_REAL, unit='s', default='0', range='[0,)', &
    identity=.false., &
    meaning='Time between snapshots of a deterministic or replayed run; 0: none'), &
    key_t('output', 'history_interval', KIND_REAL, unit='s', default='0', range='[0,)', &
    identity=.false., meaning='Time between rows of the history of such a run; 0: none'), &
    key_t('output', 'snapshot_members', KIND_INTEGER, range='[1,1000000000]', &
    size=ANY_NUMBER, example='1', needs='random_field', identity=.false., &
    meaning='Realizations whose first and last state is written during a sweep'), &
    key_t('output', 'report_seconds', KIND_REAL, unit='s', default='10', range='(0,)', &
    identity=.false., meaning='Wall clock time between two progress lines')]

  type(key_t), parameter :: KEYS(*) = [CASE_KEYS, GRID_KEYS, MATERIAL_KEYS, BODY_KEYS, &
    BOUNDARY_KEYS, LOADING_KEYS, SOLVER_KEYS, RANDOM_FIELD_KEYS, CROSS_CORRELATION_KEYS, &
    MONTE_CARLO_KEYS, STUDY_KEYS, CONTROL_VARIATE_KEYS, OUTPUT_KEYS]

contains

  !> Row of a group in GROUPS (name in lower case), 0 for an unknown one.
  pure integer function group_row(name) result(row)
    character(len=*), intent(in) :: name

    do row = size(GROUPS), 1, -1
      if (GROUPS(row)%name == name) return
    end do
  end function group_row

  !> Row of a key in KEYS (names in lower case), 0 for an unknown one.
  pure integer function key_row(group, name) result(row)
    character(len=*), intent(in) :: group, name

    do row = size(KEYS), 1, -1
      if (KEYS(row)%group == group .and. KEYS(row)%name == name) return
    end do
  end function key_row

  !> Number of words in a text of words between blanks.
  pure integer function count_words(text) result(number)
    character(len=*), intent(in) :: text
    integer :: i

    number = 0
    do i = 1, len_trim(text)
      if (text(i:i) == ' ') cycle
      if (i == 1) then
        number = number + 1
      else if (text(i - 1:i - 1) == ' ') then
        number = number + 1
      end if
    end do
  end function count_words

  !> Word `number` of a text of words between blanks; empty beyond the last.
  pure function word_at(text, number) result(word)
    character(len=*), intent(in) :: text
    integer, intent(in) :: number
    character(len=:), allocatable :: word
    integer :: i, start, length

    start = 1
    word = ''
    do i = 1, number
      length = verify(text(start:), ' ') - 1
      if (length < 0) then
        word = ''
        return
      end if
      start = start + length
      length = index(text(start:)//' ', ' ') - 1
      word = text(start:start + length - 1)
      start = start + length
    end do
  end function word_at

  pure logical function has_word(text, word)
    character(len=*), intent(in) :: text, word

    has_word = len_trim(word) > 0 .and. index(' '//trim(text)//' ', ' '//trim(word)//' ') > 0
  end function has_word

  !> Words between blanks as a list with commas.
  pure function listed(words) result(list)
    character(len=*), intent(in) :: words
    character(len=:), allocatable :: list
    integer :: i

    list = word_at(words, 1)
    do i = 2, count_words(words)
      list = list//', '//word_at(words, i)
    end do
  end function listed
end module sg_schema
